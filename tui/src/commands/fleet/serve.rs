//! The fleet's page: read from the database for everybody together, and served to browsers.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use axum::Router;
use axum::extract::{Request, State};
use axum::http::{StatusCode, Uri};
use axum::middleware::{self, Next};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::get;
use plumb_central::{CentralError, Reader};
use plumb_record::today;
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};

use super::page;
use super::series::{Asked, points};
use crate::failure::with_causes;
use crate::print_line::print_line;
use crate::web::{self, file, refusal};

/// How old the list of cells may be. All readers share it: a hundred cost the database no more than one.
const FRESH: Duration = Duration::from_secs(1);

/// How long the database may take for one answer.
const ANSWER_WITHIN: Duration = Duration::from_secs(20);

/// Why nothing is served.
#[derive(Debug, thiserror::Error)]
enum ServeError {
    #[error(
        "{0} can be reached from other machines, and what is served is not encrypted: serve on 127.0.0.1 and come by a tunnel \
         (`ssh -L 8718:localhost:8718 THIS-MACHINE`) or a proxy with TLS"
    )]
    NotThisMachine(SocketAddr),
    #[error("cannot listen on {address}: {cause}")]
    Listen { address: SocketAddr, cause: std::io::Error },
}

/// What all requests share.
struct Shared {
    names: Vec<String>,
    /// Anyone who asks has it alone.
    reader: tokio::sync::Mutex<Reader>,
    /// The list of cells, and when it was read.
    cells: Mutex<Option<(Instant, String)>>,
}

type Served = State<Arc<Shared>>;

/// Serves until it is asked to end.
pub(super) async fn serve(
    from: &str,
    listen: SocketAddr,
    names: Vec<String>,
) -> Result<(), Box<dyn std::error::Error>> {
    if !listen.ip().is_loopback() {
        return Err(ServeError::NotThisMachine(listen).into());
    }
    // An address that is none, or a database that cannot be read, is reported at once; later it may come and go.
    let mut reader = Reader::new(from, ANSWER_WITHIN);
    reader.ask(async |central| central.ping().await).await?;
    let shared = Arc::new(Shared { names, reader: tokio::sync::Mutex::new(reader), cells: Mutex::new(None) });
    let router = Router::new()
        .route("/", get(cells))
        .route("/trends", get(trends))
        .route("/trend", get(trend))
        .route("/fleet.css", get(|| async { file("text/css; charset=utf-8", include_str!("fleet.css")) }))
        .route(
            "/fleet.js",
            get(|| async { file("text/javascript; charset=utf-8", include_str!("fleet.js")) }),
        )
        .fallback(|| async { refusal(StatusCode::NOT_FOUND, "there is nothing here; the page is at /") })
        .layer(middleware::from_fn_with_state(Arc::clone(&shared), guard))
        .with_state(shared);
    let listener =
        TcpListener::bind(listen).await.map_err(|cause| ServeError::Listen { address: listen, cause })?;
    print_line!("http://{}/ (read only); Ctrl-C ends", listener.local_addr()?)?;
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    tokio::select! {
        ended = async { axum::serve(listener, router).await } => ended?,
        _ = terminate.recv() => {}
        _ = interrupt.recv() => {}
    }
    Ok(())
}

async fn guard(State(shared): Served, request: Request, next: Next) -> Response {
    web::guard(&shared.names, request, next).await
}

impl Shared {
    /// The list of cells, where it is fresh.
    fn fresh_cells(&self) -> Option<String> {
        let cells = self.cells();
        cells.as_ref().filter(|(read, _)| read.elapsed() < FRESH).map(|(_, text)| text.clone())
    }

    fn cells(&self) -> MutexGuard<'_, Option<(Instant, String)>> {
        self.cells.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

async fn cells(State(shared): Served) -> Response {
    if let Some(text) = shared.fresh_cells() {
        return Html(text).into_response();
    }
    match shared.reader.lock().await.ask(async |central| central.cells().await).await {
        Ok(cells) => {
            let text = page::cells(&cells, &today());
            *shared.cells() = Some((Instant::now(), text.clone()));
            Html(text).into_response()
        }
        Err(error) => no_answer(&error),
    }
}

async fn trends(State(shared): Served) -> Response {
    match shared.reader.lock().await.ask(async |central| central.quantities().await).await {
        Ok(quantities) => Html(page::quantities(&quantities)).into_response(),
        Err(error) => no_answer(&error),
    }
}

async fn trend(State(shared): Served, address: Uri) -> Response {
    let requested = |name: &str| {
        let mut pairs = url::form_urlencoded::parse(address.query().unwrap_or_default().as_bytes());
        pairs.find(|(key, _)| key == name).map(|(_, value)| value.into_owned())
    };
    let (name, asked) = match (requested("correction"), requested("effect")) {
        (Some(text), None) => (text.clone(), Asked::correction(&text)),
        (None, Some(text)) => (text.clone(), Asked::effect(&text)),
        _ => return bad_request("ask for one correction or one effect: /trends lists them"),
    };
    let asked = match asked {
        Ok(asked) => asked,
        Err(error) => return bad_request(&error.to_string()),
    };
    let arm = requested("arm").filter(|arm| !arm.is_empty());
    match shared.reader.lock().await.ask(async |central| points(central, &asked, arm.as_deref()).await).await
    {
        Ok(points) => Html(page::trend(&name, arm.as_deref(), &points)).into_response(),
        Err(error) => no_answer(&error),
    }
}

fn bad_request(reason: &str) -> Response {
    (StatusCode::BAD_REQUEST, Html(page::trouble("This cannot be asked", reason))).into_response()
}

/// The page goes on asking, so it says itself when the database is back.
fn no_answer(error: &CentralError) -> Response {
    let page = page::trouble("The database does not answer", &with_causes(error));
    (StatusCode::SERVICE_UNAVAILABLE, Html(page)).into_response()
}
