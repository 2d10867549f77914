//! Bytes lent for the length of a call.

use core::slice;

/// Bytes lent for the length of a call, or for ever where said so. Text is UTF-8 without a final zero.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Bytes {
    /// The first byte; may be null when `length` is 0.
    pub data: *const u8,
    /// How many.
    pub length: usize,
}

// SAFETY: the bytes are only ever read, and anyone who lends them keeps them in place.
unsafe impl Send for Bytes {}
// SAFETY: as above.
unsafe impl Sync for Bytes {}

impl Bytes {
    /// Lends a slice.
    pub const fn of(bytes: &[u8]) -> Self {
        Self { data: bytes.as_ptr(), length: bytes.len() }
    }

    /// Lends a text.
    pub const fn of_text(text: &str) -> Self {
        Self::of(text.as_bytes())
    }

    /// The bytes as a slice.
    ///
    /// # Safety
    /// `data` points to `length` bytes that stay in place and unchanged for `'a`, or `length` is 0.
    pub const unsafe fn as_slice<'a>(self) -> &'a [u8] {
        if self.data.is_null() || self.length == 0 {
            return &[];
        }
        // SAFETY: promised by the caller.
        unsafe { slice::from_raw_parts(self.data, self.length) }
    }
}
