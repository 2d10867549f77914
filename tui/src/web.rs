//! What the pages that this program serves have in common: who may ask, what a browser may do with the answer, and text in HTML.

use axum::Json;
use axum::extract::Request;
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde_json::json;

/// A page needs nothing from elsewhere, and runs nothing that does not come from here.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; \
                      base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

/// Lets through only requests that name this machine, so that no page from elsewhere can read this one through a name of its
/// own (DNS rebinding), and says what browsers may do with the answer. `names` are those of proxies that were declared.
pub(crate) async fn guard(names: &[String], request: Request, next: Next) -> Response {
    let host = request.headers().get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or_default();
    if !is_own_name(host, names) {
        return refusal(
            StatusCode::MISDIRECTED_REQUEST,
            "this is not a name of this server; --name NAME adds one",
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

/// A file of a page.
pub(crate) fn file(kind: &'static str, text: &'static str) -> Response {
    ([(header::CONTENT_TYPE, kind)], text).into_response()
}

/// A request that is not served, and why.
pub(crate) fn refusal(status: StatusCode, reason: &str) -> Response {
    (status, Json(json!({ "error": reason }))).into_response()
}

/// Text as HTML shows it, in elements and in attributes.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
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

    #[test]
    fn text_stays_text() {
        assert_eq!(escaped("<a href='x'>\"&"), "&lt;a href=&#39;x&#39;&gt;&quot;&amp;");
    }
}
