//! How messages are laid out: the one table of it. The lengths of streams, messages as JSON, what a procedure may name of a stream, and the Python
//! file of `plumb streams --python` follow from it.

use std::mem::offset_of;

use super::{
    DigitalInputs, FrameHeader, Health, JointState, JointVector, Message, PREFIX_LENGTH, ProximityEdge,
    SEQUENCE_OFFSET, StripeHeader, StripePoint,
};
use crate::description::{FieldDescription, NumberType, StreamDescription};

/// What is in a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldType {
    /// A whole number of 4 bytes.
    U32,
    /// A whole number of 8 bytes.
    U64,
    /// A number of 4 bytes.
    F32,
    /// Three of them.
    F32x3,
    /// A number of 8 bytes.
    F64,
    /// A number for each joint: [`JointVector`].
    Joints(JointQuantity),
}

/// What a field says of each joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointQuantity {
    /// Where it is: rad or mm.
    Position,
    /// How far on either side that is known: rad or mm.
    HalfWidth,
    /// How fast it goes: rad/s or mm/s.
    Speed,
}

impl FieldType {
    /// Its bytes.
    pub const fn size(self) -> usize {
        match self {
            Self::U32 | Self::F32 => 4,
            Self::U64 | Self::F64 => 8,
            Self::F32x3 => 12,
            Self::Joints(_) => size_of::<JointVector>(),
        }
    }

    /// A field of a plugin's own layout is a multiple of this from its beginning.
    pub const fn alignment(self) -> usize {
        match self {
            Self::U32 | Self::F32 | Self::F32x3 => 4,
            Self::U64 | Self::F64 | Self::Joints(_) => 8,
        }
    }
}

/// A field of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// Where it begins, bytes from the beginning of the message.
    pub offset: usize,
    /// What is in it.
    pub of: FieldType,
    /// The unit of a number; empty for one without, and for joints, each of which has its own.
    pub unit: String,
}

/// What follows the fields of a message whose length is not fixed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Tail {
    /// Bytes: the pixels of a picture.
    Bytes,
    /// Records, all alike.
    Records {
        /// What one is called, as `StripePoint`.
        class: &'static str,
        /// Its bytes.
        size: usize,
        /// Its fields, counted from its own beginning.
        fields: Vec<Field>,
    },
}

/// How the messages of a stream are laid out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Its name and version, as `joint-state/1`.
    pub name: String,
    /// What a message is called in a program, as `JointState`; empty for a plugin's own.
    pub class: &'static str,
    /// The bytes of its fields: of the whole message where nothing follows them.
    pub size: usize,
    /// Its fields, in their order, without a gap.
    pub fields: Vec<Field>,
    /// What follows them.
    pub tail: Option<Tail>,
}

/// A row of the table: where the compiler has put a field, and what it is.
macro_rules! fields {
    ($message:ty: $($name:ident $of:expr, $unit:literal;)*) => {
        vec![$(Field { name: stringify!($name).to_owned(), offset: offset_of!($message, $name), of: $of, unit: $unit.to_owned() }),*]
    };
}

impl Layout {
    /// The layouts that this crate knows.
    pub fn all() -> Vec<Self> {
        use FieldType::{F32, F32x3, Joints, U32, U64};
        use JointQuantity::{HalfWidth, Position, Speed};
        let point = fields!(StripePoint: u_px F32, "px"; v_px F32, "px"; sigma_px F32, "px"; width_px F32, "px"; intensity F32, ""; flags U32, "";
            flange_mm F32x3, "mm"; sigma_mm F32, "mm";);
        vec![
            fixed::<JointState>(
                "JointState",
                fields!(JointState: time_ns U64, "ns"; sequence U64, ""; moving U32, ""; reserved U32, ""; joints Joints(Position), "";),
            ),
            fixed::<DigitalInputs>(
                "DigitalInputs",
                fields!(DigitalInputs: time_ns U64, "ns"; sequence U64, ""; levels U64, ""; changed U64, ""; joints Joints(Position), "";
                    joints_half_width Joints(HalfWidth), "";),
            ),
            fixed::<ProximityEdge>(
                "ProximityEdge",
                fields!(ProximityEdge: time_ns U64, "ns"; sequence U64, ""; fired U32, ""; reserved U32, ""; joints Joints(Position), "";
                    joints_half_width Joints(HalfWidth), "";),
            ),
            fixed::<Health>(
                "Health",
                fields!(Health: time_ns U64, "ns"; sequence U64, ""; state U32, ""; reserved U32, ""; requests U64, ""; failures U64, "";
                    longest_ns U64, "ns";),
            ),
            Self {
                tail: Some(Tail::Bytes),
                ..fixed::<FrameHeader>(
                    "FrameHeader",
                    fields!(FrameHeader: time_ns U64, "ns"; sequence U64, ""; width U32, "px"; height U32, "px"; exposure_ns U64, "ns";),
                )
            },
            Self {
                tail: Some(Tail::Records {
                    class: "StripePoint",
                    size: size_of::<StripePoint>(),
                    fields: point,
                }),
                ..fixed::<StripeHeader>(
                    "StripeHeader",
                    fields!(StripeHeader: time_ns U64, "ns"; sequence U64, ""; count U32, ""; fault U32, ""; joints Joints(Position), "";
                        speeds Joints(Speed), "";),
                )
            },
        ]
    }

    /// A layout of this crate, by its name.
    pub fn known(type_name: &str) -> Option<Self> {
        Self::all().into_iter().find(|layout| layout.name == type_name)
    }

    /// The layout of a stream: one of this crate, or the fields that its manifest declares. `None` for a message of a plugin's own of which the manifest
    /// says nothing.
    pub fn of(stream: &StreamDescription) -> Option<Self> {
        Self::known(&stream.message).or_else(|| (!stream.fields.is_empty()).then(|| declared(stream)))
    }

    /// The bytes of every message, where they all have as many.
    pub fn length(&self) -> Option<usize> {
        self.tail.is_none().then_some(self.size)
    }

    /// The fields that say something: all but the empty entries.
    pub fn visible_fields(&self) -> impl Iterator<Item = &Field> {
        self.fields.iter().filter(|field| field.name != RESERVED)
    }
}

/// The name of an empty entry in a layout.
const RESERVED: &str = "reserved";

fn fixed<M: Message>(class: &'static str, fields: Vec<Field>) -> Layout {
    Layout { name: M::TYPE_NAME.to_owned(), class, size: size_of::<M>(), fields, tail: None }
}

/// What every message begins with.
fn prefix() -> Vec<Field> {
    let field = |name: &str, offset, unit: &str| Field {
        name: name.to_owned(),
        offset,
        of: FieldType::U64,
        unit: unit.to_owned(),
    };
    vec![field("time_ns", 0, "ns"), field("sequence", SEQUENCE_OFFSET, "")]
}

/// The layout of the fields that a manifest declares: behind time and number, in their order, each at the next offset that suits its type, as a C compiler
/// lays out a struct.
fn declared(stream: &StreamDescription) -> Layout {
    let mut fields = prefix();
    let mut end = PREFIX_LENGTH;
    for FieldDescription { name, of, unit } in &stream.fields {
        let of = type_of(*of);
        let offset = end.next_multiple_of(of.alignment());
        end = offset + of.size();
        fields.push(Field { name: name.clone(), offset, of, unit: unit.clone() });
    }
    Layout { name: stream.message.clone(), class: "", size: end.next_multiple_of(8), fields, tail: None }
}

fn type_of(number: NumberType) -> FieldType {
    match number {
        NumberType::F64 => FieldType::F64,
        NumberType::F32 => FieldType::F32,
        NumberType::U64 => FieldType::U64,
        NumberType::U32 => FieldType::U32,
    }
}

impl Field {
    /// Its bytes in a message.
    fn bytes<'m>(&self, message: &'m [u8]) -> Option<&'m [u8]> {
        message.get(self.offset..self.offset + self.of.size())
    }

    /// Its number; none of a field that holds several, or of a message that is too short.
    pub fn number(&self, message: &[u8]) -> Option<f64> {
        let bytes = self.bytes(message)?;
        match self.of {
            FieldType::U32 => Some(f64::from(bytemuck::pod_read_unaligned::<u32>(bytes))),
            FieldType::U64 => Some(bytemuck::pod_read_unaligned::<u64>(bytes) as f64),
            FieldType::F32 => Some(f64::from(bytemuck::pod_read_unaligned::<f32>(bytes))),
            FieldType::F64 => Some(bytemuck::pod_read_unaligned(bytes)),
            FieldType::F32x3 | FieldType::Joints(_) => None,
        }
    }

    /// Its whole number.
    pub fn whole(&self, message: &[u8]) -> Option<u64> {
        let bytes = self.bytes(message)?;
        match self.of {
            FieldType::U32 => Some(u64::from(bytemuck::pod_read_unaligned::<u32>(bytes))),
            FieldType::U64 => Some(bytemuck::pod_read_unaligned(bytes)),
            _ => None,
        }
    }

    /// Its numbers for the joints.
    pub fn joints(&self, message: &[u8]) -> Option<JointVector> {
        match self.of {
            FieldType::Joints(_) => self.bytes(message).map(bytemuck::pod_read_unaligned),
            _ => None,
        }
    }

    /// Writes bytes of its length into a message.
    pub(super) fn write(&self, message: &mut [u8], bytes: &[u8]) {
        if let Some(own) = message.get_mut(self.offset..self.offset + self.of.size())
            && own.len() == bytes.len()
        {
            own.copy_from_slice(bytes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table holds every byte of every layout: one that was changed without its row, or a row of another type, leaves a gap or an overlap.
    #[test]
    fn the_fields_of_every_layout_follow_each_other_without_a_gap_to_its_end() {
        let tiles = |name: &str, fields: &[Field], size: usize| {
            let mut end = 0;
            for field in fields {
                assert_eq!(field.offset, end, "{name}: {}", field.name);
                end += field.of.size();
            }
            assert_eq!(end, size, "{name}");
        };
        for layout in Layout::all() {
            tiles(&layout.name, &layout.fields, layout.size);
            assert_eq!(layout.fields[..2], prefix(), "{}", layout.name);
            if let Some(Tail::Records { class, size, fields }) = &layout.tail {
                tiles(class, fields, *size);
            }
        }
        assert_eq!(Layout::all().len(), 6);
    }

    #[test]
    fn a_layout_that_a_manifest_declares_lies_as_a_c_compiler_lays_out_a_struct() {
        #[repr(C)]
        struct Weight {
            time_ns: u64,
            sequence: u64,
            grams: f64,
            settled: u32,
            temperature: f32,
            raw: u32,
            drift: f64,
        }
        let field = |name: &str, of| FieldDescription { name: name.to_owned(), of, unit: String::new() };
        let mut stream = StreamDescription::of::<JointState>("weights");
        stream.message = "weight/1".to_owned();
        assert_eq!(Layout::of(&stream), None, "nothing is known of it");
        stream.fields = vec![
            field("grams", NumberType::F64),
            field("settled", NumberType::U32),
            field("temperature", NumberType::F32),
            field("raw", NumberType::U32),
            field("drift", NumberType::F64),
        ];
        let layout = Layout::of(&stream).unwrap();
        let offsets: Vec<usize> = layout.fields.iter().map(|field| field.offset).collect();
        let requested = [
            offset_of!(Weight, time_ns),
            offset_of!(Weight, sequence),
            offset_of!(Weight, grams),
            offset_of!(Weight, settled),
            offset_of!(Weight, temperature),
            offset_of!(Weight, raw),
            offset_of!(Weight, drift),
        ];
        assert_eq!(offsets, requested);
        assert_eq!(layout.length(), Some(size_of::<Weight>()));
    }
}
