//! Numbers as files of points hold them.

/// How a number is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NumberFormat {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl NumberFormat {
    /// By its name in a PLY file.
    pub(crate) fn of_ply(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// By its kind and its bytes in a PCD file.
    pub(crate) fn of_pcd(kind: &str, bytes: &str) -> Option<Self> {
        Some(match (kind, bytes) {
            ("I", "1") => Self::I8,
            ("U", "1") => Self::U8,
            ("I", "2") => Self::I16,
            ("U", "2") => Self::U16,
            ("I", "4") => Self::I32,
            ("U", "4") => Self::U32,
            ("F", "4") => Self::F32,
            ("F", "8") => Self::F64,
            _ => return None,
        })
    }
}

/// Numbers one after the other.
pub(crate) enum Numbers<'a> {
    /// In words.
    Written(Box<dyn Iterator<Item = f64> + 'a>),
    /// In bytes.
    Bytes {
        /// What is left.
        left: &'a [u8],
        /// The most significant byte comes first.
        big_endian: bool,
    },
}

impl<'a> Numbers<'a> {
    pub(crate) fn written(bytes: &'a [u8]) -> Self {
        let words = bytes.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let number = |word: &[u8]| std::str::from_utf8(word).ok()?.parse::<f64>().ok();
        // What is no number ends them, as the end of the file does.
        Self::Written(Box::new(words.map_while(number)))
    }

    pub(crate) fn little_endian(bytes: &'a [u8]) -> Self {
        Self::Bytes { left: bytes, big_endian: false }
    }

    pub(crate) fn big_endian(bytes: &'a [u8]) -> Self {
        Self::Bytes { left: bytes, big_endian: true }
    }

    /// The next number; none at the end.
    pub(crate) fn next(&mut self, format: NumberFormat) -> Option<f64> {
        match self {
            Self::Written(numbers) => numbers.next(),
            Self::Bytes { left, big_endian } => {
                let big = *big_endian;
                Some(match format {
                    NumberFormat::I8 => f64::from(i8::from_le_bytes(take(left, big)?)),
                    NumberFormat::U8 => f64::from(u8::from_le_bytes(take(left, big)?)),
                    NumberFormat::I16 => f64::from(i16::from_le_bytes(take(left, big)?)),
                    NumberFormat::U16 => f64::from(u16::from_le_bytes(take(left, big)?)),
                    NumberFormat::I32 => f64::from(i32::from_le_bytes(take(left, big)?)),
                    NumberFormat::U32 => f64::from(u32::from_le_bytes(take(left, big)?)),
                    NumberFormat::F32 => f64::from(f32::from_le_bytes(take(left, big)?)),
                    NumberFormat::F64 => f64::from_le_bytes(take(left, big)?),
                })
            }
        }
    }
}

/// The next bytes, the least significant first.
fn take<const COUNT: usize>(left: &mut &[u8], big_endian: bool) -> Option<[u8; COUNT]> {
    let (bytes, rest) = left.split_first_chunk::<COUNT>()?;
    *left = rest;
    let mut bytes = *bytes;
    if big_endian {
        bytes.reverse();
    }
    Some(bytes)
}
