//! What is served under which path.

use std::convert::Infallible;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{HeaderMap, StatusCode, Uri, header};
use axum::middleware::{self, Next};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use futures_util::Stream;
use futures_util::stream::unfold;
use serde_json::json;

use super::answering::{GivenAnswer, NotTaken, give};
use super::drawings::{self, DrawingError};
use super::lease::{HOLDS, LeaseError};
use super::shared::Shared;
use super::state::PageState;
use super::token;
use crate::web::{self, file, refusal};

/// Longest body of a request, bytes. An answer is a line.
const LONGEST_BODY: usize = 16 * 1024;

/// How often a silent stream says that it lives, so that proxies leave it open.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

type Served = State<Arc<Shared>>;

/// All paths.
pub(super) fn router(shared: Arc<Shared>) -> Router {
    Router::new()
        .route("/", get(|| async { file("text/html; charset=utf-8", include_str!("page.html")) }))
        .route("/page.js", get(|| async { file("text/javascript; charset=utf-8", include_str!("page.js")) }))
        .route("/page.css", get(|| async { file("text/css; charset=utf-8", include_str!("page.css")) }))
        .route("/api/state", get(state))
        .route("/api/events", get(events))
        .route("/api/drawings", get(drawings))
        .route("/api/fall.svg", get(error_steps))
        .route("/api/cloud.png", get(cloud))
        .route("/api/lease", post(take_lease).delete(give_lease_back))
        .route("/api/answer", post(answer))
        .fallback(|| async { refusal(StatusCode::NOT_FOUND, "there is nothing here; the page is at /") })
        .layer(DefaultBodyLimit::max(LONGEST_BODY))
        .layer(middleware::from_fn_with_state(Arc::clone(&shared), guard))
        .with_state(shared)
}

/// See [`web::guard`].
async fn guard(State(shared): Served, request: Request, next: Next) -> Response {
    web::guard(&shared.names, request, next).await
}

async fn state(State(shared): Served) -> Json<PageState> {
    Json(PageState::clone(&shared.state.borrow()))
}

/// The state at once, and again whenever it changes.
async fn events(State(shared): Served) -> Sse<impl Stream<Item = Result<Event, Infallible>>> {
    let mut state = shared.state.clone();
    state.mark_changed();
    let stream = unfold(state, |mut state| async move {
        state.changed().await.ok()?;
        let now = Arc::clone(&state.borrow_and_update());
        let event = Event::default().event("state").json_data(&*now).ok()?;
        Some((Ok(event), state))
    });
    Sse::new(stream).keep_alive(KeepAlive::new().interval(KEEP_ALIVE))
}

/// A part of an address's query.
fn part(address: &Uri, name: &str) -> Option<String> {
    let mut pairs = url::form_urlencoded::parse(address.query().unwrap_or_default().as_bytes());
    pairs.find(|(key, _)| key == name).map(|(_, value)| value.into_owned())
}

/// Draws on a thread that may wait, one picture at a time: a run beside it needs the machine.
async fn drawn<T: Send + 'static>(
    shared: &Arc<Shared>,
    address: &Uri,
    draw: impl FnOnce(&Path, i64) -> Result<T, DrawingError> + Send + 'static,
) -> Result<T, Response> {
    let run = part(address, "run").and_then(|run| run.parse::<i64>().ok());
    let run = run.ok_or_else(|| refusal(StatusCode::BAD_REQUEST, "say which run, as in ?run=12"))?;
    let _alone = shared.drawing.lock().await;
    let directory = shared.directory.clone();
    let drawn = tokio::task::spawn_blocking(move || draw(&directory, run)).await;
    let internal = || refusal(StatusCode::INTERNAL_SERVER_ERROR, "the picture was given up");
    drawn.map_err(|_| internal())?.map_err(|error| refusal(StatusCode::NOT_FOUND, &error.to_string()))
}

async fn drawings(State(shared): Served, address: Uri) -> Response {
    match drawn(&shared, &address, drawings::list).await {
        Ok(list) => Json(list).into_response(),
        Err(refused) => refused,
    }
}

async fn error_steps(State(shared): Served, address: Uri) -> Response {
    let model = part(&address, "model").and_then(|model| model.parse().ok()).unwrap_or(0);
    match drawn(&shared, &address, move |directory, run| drawings::error_steps(directory, run, model)).await {
        Ok(svg) => ([(header::CONTENT_TYPE, "image/svg+xml")], svg).into_response(),
        Err(refused) => refused,
    }
}

async fn cloud(State(shared): Served, address: Uri) -> Response {
    let name = part(&address, "name").unwrap_or_default();
    match drawn(&shared, &address, move |directory, run| drawings::cloud(directory, run, &name)).await {
        Ok(png) => ([(header::CONTENT_TYPE, "image/png")], png).into_response(),
        Err(refused) => refused,
    }
}

/// Who asks for the lease.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct LeaseRequest {
    name: String,
    /// The key, to renew it or to give it back.
    #[serde(default)]
    lease: Option<String>,
}

async fn take_lease(State(shared): Served, headers: HeaderMap, Json(asked): Json<LeaseRequest>) -> Response {
    if let Some(refused) = unauthorised(&shared, &headers) {
        return refused;
    }
    let Ok(fresh) = token::random_key() else {
        return refusal(StatusCode::INTERNAL_SERVER_ERROR, "the system gives no random numbers");
    };
    let taken = shared.leases().take(&asked.name, asked.lease.as_deref(), fresh, Instant::now());
    match taken {
        Ok(key) => Json(json!({ "lease": key, "holds_s": HOLDS.as_secs() })).into_response(),
        Err(error @ LeaseError::NoName) => refusal(StatusCode::UNPROCESSABLE_ENTITY, &error.to_string()),
        Err(error) => refusal(StatusCode::CONFLICT, &error.to_string()),
    }
}

async fn give_lease_back(
    State(shared): Served,
    headers: HeaderMap,
    Json(asked): Json<LeaseRequest>,
) -> Response {
    if let Some(refused) = unauthorised(&shared, &headers) {
        return refused;
    }
    shared.leases().give_back(&asked.lease.unwrap_or_default());
    StatusCode::NO_CONTENT.into_response()
}

async fn answer(State(shared): Served, headers: HeaderMap, Json(given): Json<GivenAnswer>) -> Response {
    if let Some(refused) = unauthorised(&shared, &headers) {
        return refused;
    }
    let holder = match shared.leases().holder(&given.lease, Instant::now()) {
        Ok(holder) => holder,
        Err(error) => return refusal(StatusCode::CONFLICT, &error.to_string()),
    };
    let directory = shared.directory.clone();
    // It waits until the run has taken the answer, so it gets a thread that may wait.
    let given = tokio::task::spawn_blocking(move || give(&directory, &given, &holder)).await;
    match given {
        Ok(Ok(())) => Json(json!({ "taken": true })).into_response(),
        Ok(Err(NotTaken { status, reason })) => refusal(status, &reason),
        Err(_) => refusal(StatusCode::INTERNAL_SERVER_ERROR, "the answer was given up"),
    }
}

/// Why a request may not change anything: it does not carry the token. None where it does.
fn unauthorised(shared: &Shared, headers: &HeaderMap) -> Option<Response> {
    let Some(token) = &shared.token else {
        let reason = "this page is read only: it was started without --token-file";
        return Some(refusal(StatusCode::FORBIDDEN, reason));
    };
    let given = headers.get(header::AUTHORIZATION).and_then(|value| value.to_str().ok()).unwrap_or_default();
    match given.strip_prefix("Bearer ") {
        Some(given) if token.is(given) => None,
        _ => Some(refusal(StatusCode::UNAUTHORIZED, "the token is wrong or missing")),
    }
}
