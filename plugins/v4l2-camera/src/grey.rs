//! From what cameras send to 8 bits of grey.

/// How the brightness of a row's pixels lies in its bytes. Colours beside it, or below it in the buffer, are passed over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct GreyFormat {
    /// The four characters of the kernel's list.
    pub(crate) code: [u8; 4],
    /// From pixel to pixel, bytes.
    step: usize,
    /// Where the (lower) byte of the brightness is in a pixel.
    offset: usize,
    /// Bits of brightness: 8 in one byte, more in two, the lower first.
    bits: u32,
}

/// How a camera's pictures come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Layout {
    /// Pixels in a row.
    pub(crate) width: u32,
    /// Rows.
    pub(crate) height: u32,
    /// From row to row, bytes.
    pub(crate) stride: usize,
    /// How its pixels lie in a row.
    pub(crate) format: GreyFormat,
    /// From picture to picture, ns, where the driver says.
    pub(crate) interval_ns: Option<u64>,
}

const fn format(code: &[u8; 4], step: usize, offset: usize, bits: u32) -> GreyFormat {
    GreyFormat { code: *code, step, offset, bits }
}

/// The formats that are taken, the best first. Compressed ones are not among them: compression moves the edges of a line.
pub(crate) const FORMATS: [GreyFormat; 8] = [
    format(b"GREY", 1, 0, 8),
    format(b"Y10 ", 2, 0, 10),
    format(b"Y12 ", 2, 0, 12),
    format(b"Y16 ", 2, 0, 16),
    format(b"NV12", 1, 0, 8),
    format(b"YU12", 1, 0, 8),
    format(b"YUYV", 2, 0, 8),
    format(b"UYVY", 2, 1, 8),
];

impl GreyFormat {
    /// As people write it.
    pub(crate) fn name(&self) -> String {
        name(self.code)
    }

    /// By its name.
    pub(crate) fn named(name: &str) -> Option<Self> {
        FORMATS.into_iter().find(|format| format.name() == name)
    }

    /// The fewest bytes in a row of so many pixels.
    pub(crate) fn row_bytes(&self, width: u32) -> usize {
        self.step * width as usize
    }
}

/// Four characters of the kernel's list as people write them.
pub(crate) fn name(code: [u8; 4]) -> String {
    String::from_utf8_lossy(&code).trim_end().to_owned()
}

impl Layout {
    /// The fewest bytes that hold a picture.
    pub(crate) fn picture_bytes(&self) -> usize {
        (self.height as usize).saturating_sub(1) * self.stride + self.format.row_bytes(self.width)
    }

    /// The picture of a buffer in 8 bits of grey, a row after the other; none of a buffer that is too short.
    pub(crate) fn grey(&self, bytes: &[u8]) -> Option<Vec<u8>> {
        bytes.get(..self.picture_bytes())?;
        let GreyFormat { step, offset, bits, .. } = self.format;
        let mut pixels = Vec::with_capacity(self.width as usize * self.height as usize);
        for row in bytes.chunks(self.stride).take(self.height as usize) {
            let row = row.get(..self.format.row_bytes(self.width))?;
            match (step, bits) {
                (1, _) => pixels.extend_from_slice(row),
                (_, 8) => pixels.extend(row.iter().skip(offset).step_by(step)),
                _ => pixels.extend(row.chunks_exact(step).map(|pixel| upper_bits(pixel, bits))),
            }
        }
        Some(pixels)
    }
}

/// The upper 8 of a pixel's bits, which lie in two bytes; more than there should be are white.
fn upper_bits(pixel: &[u8], bits: u32) -> u8 {
    let [low, high, ..] = pixel else { return 0 };
    (u16::from_le_bytes([*low, *high]) >> (bits - 8)).min(255) as u8
}
