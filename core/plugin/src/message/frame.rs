//! A picture of a camera.

use bytemuck::{Pod, Zeroable};

use super::{Message, MessageError};

/// What is before the pixels of a camera's picture. A message of `frame/1` is this, then `width * height` bytes of grey, a row after the
/// other from the top, then zeros up to a multiple of 8.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct FrameHeader {
    /// The middle of the exposure: ns of the cell's clock.
    pub time_ns: u64,
    /// The message's number in its stream, written by the host.
    pub sequence: u64,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// How long the shutter was open: ns; 0 when not known.
    pub exposure_ns: u64,
}

impl Message for FrameHeader {
    const TYPE_NAME: &'static str = "frame/1";
}

impl FrameHeader {
    /// The bytes of the pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The bytes of a whole message.
    pub fn message_bytes(&self) -> usize {
        (size_of::<Self>() + self.pixels()).next_multiple_of(8)
    }

    /// Writes the header into the bytes of a message, and hands out the bytes of the pixels.
    ///
    /// # Errors
    /// [`MessageError`] when the message has not [`FrameHeader::message_bytes`].
    pub fn write<'m>(&self, message: &'m mut [u8]) -> Result<&'m mut [u8], MessageError> {
        let (length, needed) = (message.len(), self.message_bytes());
        let wrong = || MessageError { type_name: Self::TYPE_NAME, needed, length };
        if length != needed {
            return Err(wrong());
        }
        let (header, rest) = message.split_at_mut(size_of::<Self>());
        header.copy_from_slice(bytemuck::bytes_of(self));
        let (pixels, padding) = rest.split_at_mut(self.pixels());
        padding.fill(0);
        Ok(pixels)
    }

    /// The header and the pixels of a message.
    ///
    /// # Errors
    /// [`MessageError`] when it is shorter than its header says.
    pub fn read(message: &[u8]) -> Result<(Self, &[u8]), MessageError> {
        let wrong =
            |needed: usize| MessageError { type_name: Self::TYPE_NAME, needed, length: message.len() };
        let begin = message.get(..size_of::<Self>()).ok_or_else(|| wrong(size_of::<Self>()))?;
        let header: Self = bytemuck::pod_read_unaligned(begin);
        let pixels = message.get(size_of::<Self>()..size_of::<Self>() + header.pixels());
        pixels.map(|pixels| (header, pixels)).ok_or_else(|| wrong(header.message_bytes()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_goes_through_its_message_and_a_cut_one_is_refused() {
        let header = FrameHeader { time_ns: 5, width: 3, height: 3, ..Default::default() };
        let mut message = vec![9; header.message_bytes()];
        header.write(&mut message).unwrap().copy_from_slice(&[1, 2, 3, 4, 5, 6, 7, 8, 9]);
        assert_eq!(message.len() % 8, 0);
        let (again, pixels) = FrameHeader::read(&message).unwrap();
        assert_eq!((again, pixels), (header, &[1, 2, 3, 4, 5, 6, 7, 8, 9][..]));
        assert_eq!(
            FrameHeader::read(&message[..40]).unwrap_err().to_string(),
            "a message of frame/1 has 40 bytes; its header says 48"
        );
    }
}
