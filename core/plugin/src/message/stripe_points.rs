//! What a light stripe sensor found in one picture.

use bytemuck::{Pod, Zeroable};

use super::{JointVector, Message, MessageError};

/// What is before the points of a light stripe. A message of `stripe-points/2` is this, then `count` times [`StripePoint`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct StripeHeader {
    /// The middle of the exposure: ns of the cell's clock.
    pub time_ns: u64,
    /// The message's number in its stream, written by the host.
    pub sequence: u64,
    /// How many points follow.
    pub count: u32,
    /// Why there are none: 0 when there are some, otherwise [`StripeFault::code`].
    pub fault: u32,
    /// The robot's joints at the moment of the exposure: rad, or mm where its description says so; none when not known.
    pub joints: JointVector,
    /// How fast they went then: rad/s or mm/s; none when not known.
    pub speeds: JointVector,
}

/// One point of a light stripe.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct StripePoint {
    /// Its column in the picture, pixels; the middle of the first pixel is 0.
    pub u_px: f32,
    /// Its row.
    pub v_px: f32,
    /// The column's standard uncertainty, pixels.
    pub sigma_px: f32,
    /// How wide the stripe is there, pixels.
    pub width_px: f32,
    /// The brightest grey level, 0 to 255.
    pub intensity: f32,
    /// 1: saturated, 2: a spur was cut off, 4: at the picture's edge.
    pub flags: u32,
    /// Where it is in the flange's frame, mm: x, y, z; not-a-number when the rig is not known.
    pub flange_mm: [f32; 3],
    /// What a standard uncertainty of the column comes to, mm.
    pub sigma_mm: f32,
}

/// Why a picture gave no points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the plugin says in words what each means")]
pub enum StripeFault {
    Dark,
    Bright,
    Short,
    Flat,
    Ambiguous,
}

impl StripeFault {
    /// All there are.
    pub const ALL: [Self; 5] = [Self::Dark, Self::Bright, Self::Short, Self::Flat, Self::Ambiguous];

    /// Its number in messages, from 1.
    pub fn code(self) -> u32 {
        self as u32 + 1
    }

    /// The fault of a number.
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|fault| fault.code() == code)
    }

    /// A word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dark => "dark",
            Self::Bright => "too bright",
            Self::Short => "too short",
            Self::Flat => "flat",
            Self::Ambiguous => "ambiguous",
        }
    }
}

impl Message for StripeHeader {
    const TYPE_NAME: &'static str = "stripe-points/2";
}

impl StripeHeader {
    /// The bytes of a message with its points.
    pub fn message(&self, points: &[StripePoint]) -> Vec<u8> {
        let header = Self { count: points.len() as u32, ..*self };
        let mut message = bytemuck::bytes_of(&header).to_vec();
        message.extend_from_slice(bytemuck::cast_slice(points));
        message
    }

    /// The header and the points of a message.
    ///
    /// # Errors
    /// [`MessageError`] when it is shorter than its header says.
    pub fn read(message: &[u8]) -> Result<(Self, Vec<StripePoint>), MessageError> {
        let wrong =
            |needed: usize| MessageError { type_name: Self::TYPE_NAME, needed, length: message.len() };
        let begin = message.get(..size_of::<Self>()).ok_or_else(|| wrong(size_of::<Self>()))?;
        let header: Self = bytemuck::pod_read_unaligned(begin);
        let needed = size_of::<Self>() + header.count as usize * size_of::<StripePoint>();
        let points = message.get(size_of::<Self>()..needed).ok_or_else(|| wrong(needed))?;
        let points = points.chunks_exact(size_of::<StripePoint>()).map(bytemuck::pod_read_unaligned);
        Ok((header, points.collect()))
    }
}
