//! What a procedure may name of a stream: its fields by their names, each with its unit at the end, as `joints.elbow_deg`.

use crate::expression::Shape;

/// The streams of a device whose manifest is known.
#[derive(Debug, Clone)]
pub(crate) struct DeviceStreams {
    pub(crate) device: String,
    pub(crate) streams: Vec<StreamNames>,
}

/// A stream and what may be named of its messages.
#[derive(Debug, Clone)]
pub(crate) struct StreamNames {
    /// As its manifest calls it.
    pub(crate) name: String,
    /// Its layout, as `joint-state/1`.
    pub(crate) message: String,
    pub(crate) fields: Vec<FieldName>,
}

/// A number in the messages of a stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FieldName {
    /// `moving`, or `joints.elbow_deg`.
    pub(crate) path: String,
    /// As people write it: `deg/s`; empty for a number without.
    pub(crate) unit: String,
}

impl StreamNames {
    /// What expressions may name below `message`.
    pub(crate) fn shape(&self) -> Shape {
        let mut entries: Vec<(String, Shape)> = Vec::new();
        for field in &self.fields {
            let Some((group, name)) = field.path.split_once('.') else {
                entries.push((field.path.clone(), Shape::Single));
                continue;
            };
            let inner = (name.to_owned(), Shape::Single);
            match entries.iter_mut().find(|(known, _)| known == group) {
                Some((_, Shape::Map(inside))) => inside.push(inner),
                _ => entries.push((group.to_owned(), Shape::Map(vec![inner]))),
            }
        }
        Shape::Map(entries)
    }
}
