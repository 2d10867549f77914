//! What precedes the body of a request and of an answer.

use bytemuck::{Pod, Zeroable};

use crate::service::WORD;

/// What precedes the body of a request.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct RequestHeader {
    /// The code of the request.
    pub(super) operation: u32,
    /// The bytes of the body.
    pub(super) body: u32,
    /// The span of the orchestrator's log it belongs to; 0 for none.
    pub(super) span: u64,
    /// How long it may take: ns.
    pub(super) time_limit_ns: u64,
}

/// What precedes the body of an answer.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct ReplyHeader {
    /// The code of the reply.
    pub(super) code: u32,
    /// The status, for an error.
    pub(super) status: i32,
    /// The bytes of the body.
    pub(super) body: u32,
    pub(super) reserved: u32,
}

/// A header that says how long the body behind it is.
pub(super) trait Header: Pod {
    /// The bytes of the body.
    fn body_length(&self) -> usize;
}

impl Header for RequestHeader {
    fn body_length(&self) -> usize {
        self.body as usize
    }
}

impl Header for ReplyHeader {
    fn body_length(&self) -> usize {
        self.body as usize
    }
}

/// The words a header and a body of some bytes take.
pub(super) fn words<H: Header>(body: usize) -> usize {
    (size_of::<H>() + body).div_ceil(WORD)
}

/// The header at the beginning of some words, and the body behind it; `None` when there are too few.
pub(super) fn split<H: Header>(words: &[u64]) -> Option<(H, &[u8])> {
    let (header, rest) = bytemuck::cast_slice::<u64, u8>(words).split_at_checked(size_of::<H>())?;
    let header: H = bytemuck::try_pod_read_unaligned(header).ok()?;
    Some((header, rest.get(..header.body_length())?))
}

/// Writes a header and a body to the words they take.
pub(super) fn join<H: Header>(target: &mut [u64], header: &H, body: &[u8]) {
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(target);
    if let Some((head, tail)) = bytes.split_at_mut_checked(size_of::<H>())
        && let Some(tail) = tail.get_mut(..body.len())
    {
        head.copy_from_slice(bytemuck::bytes_of(header));
        tail.copy_from_slice(body);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_longer_than_what_came_is_refused() {
        let header = RequestHeader { operation: 1, body: 9, span: 0, time_limit_ns: 0 };
        let mut target = vec![0; words::<RequestHeader>(9)];
        join(&mut target, &header, b"123456789");
        assert_eq!(
            split::<RequestHeader>(&target).map(|(_, body)| body.to_vec()),
            Some(b"123456789".to_vec())
        );
        assert!(split::<RequestHeader>(&target[..4]).is_none());
        assert!(split::<RequestHeader>(&target[..1]).is_none());
    }
}
