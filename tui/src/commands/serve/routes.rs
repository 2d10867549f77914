//! What is served under which path.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use futures_util::Stream;
use futures_util::stream::unfold;
use serde_json::json;

use super::answering::{GivenAnswer, NotTaken, give};
use super::lease::{HOLDS, LeaseError};
use super::shared::Shared;
use super::state::PageState;
use super::token;

/// Longest body of a request, bytes. An answer is a line.
const LONGEST_BODY: usize = 16 * 1024;

/// How often a silent stream says that it lives, so that proxies leave it open.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// The page needs nothing from elsewhere, and runs nothing that does not come from here.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

type Served = State<Arc<Shared>>;

/// All paths.
pub(super) fn router(shared: Arc<Shared>) -> Router {
    Router::new()
        .route("/", get(|| async { file("text/html; charset=utf-8", include_str!("page.html")) }))
        .route("/page.js", get(|| async { file("text/javascript; charset=utf-8", include_str!("page.js")) }))
        .route("/page.css", get(|| async { file("text/css; charset=utf-8", include_str!("page.css")) }))
        .route("/api/state", get(state))
        .route("/api/events", get(events))
        .route("/api/lease", post(take_lease).delete(give_lease_back))
        .route("/api/answer", post(answer))
        .fallback(|| async { refusal(StatusCode::NOT_FOUND, "there is nothing here; the page is at /") })
        .layer(DefaultBodyLimit::max(LONGEST_BODY))
        .layer(middleware::from_fn_with_state(Arc::clone(&shared), guard))
        .with_state(shared)
}

/// Lets through only requests that name this machine, so that no page from elsewhere can read this one through a name of its
/// own (DNS rebinding), and says what browsers may do with the answer.
async fn guard(State(shared): Served, request: Request, next: Next) -> Response {
    let host = request.headers().get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or_default();
    if !is_own_name(host, &shared.names) {
        return refusal(
            StatusCode::MISDIRECTED_REQUEST,
            "this is not a name of this server; `plumb serve --name NAME` adds one",
        );
    }
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}

/// Whether a `Host` header names this machine, or a proxy that was declared.
fn is_own_name(host: &str, names: &[String]) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if !port.is_empty() && port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    };
    ["localhost", "127.0.0.1", "[::1]"].contains(&name)
        || names.iter().any(|own| own.eq_ignore_ascii_case(name))
}

fn file(kind: &'static str, text: &'static str) -> Response {
    ([(header::CONTENT_TYPE, kind)], text).into_response()
}

fn refusal(status: StatusCode, reason: &str) -> Response {
    (status, Json(json!({ "error": reason }))).into_response()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_this_machine_are_served() {
        let names = vec!["cell3.lab".to_owned()];
        for own in [
            "localhost",
            "localhost:8717",
            "127.0.0.1:1",
            "[::1]:8717",
            "[::1]",
            "CELL3.lab",
            "cell3.lab:443",
        ] {
            assert!(is_own_name(own, &names), "{own}");
        }
        for other in [
            "",
            "evil.example",
            "evil.example:8717",
            "localhost.evil.example",
            "cell3.lab.evil",
            "127.0.0.1.evil:80",
        ] {
            assert!(!is_own_name(other, &names), "{other}");
        }
    }
}
