//! All kinds of step.

use std::sync::Arc;

use super::declaration::Action;
use super::kind::Kind;
use crate::read_context::ReadContext;
use plumb_document::{Key, Node, did_you_mean};

/// The kinds there are. Messages, schemas and the engine read them from here.
pub(crate) const KINDS: &[Kind] = &[
    super::prompt::KIND,
    super::move_joints::KIND,
    super::search::KIND,
    super::configure::KIND,
    super::measure::KIND,
    super::motors::KIND,
    super::listen::KIND,
    super::scan::KIND,
    super::row::KIND,
    super::repeat::KIND,
    super::compute::KIND,
    super::check::KIND,
    super::apply::KIND,
    super::correct::KIND,
    super::declare::KIND,
    super::call::KIND,
];

/// The kind of this name.
pub(crate) fn kind(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|kind| kind.name == name)
}

/// Reads what a step does; an unknown kind is reported.
pub(crate) fn read_action(
    key: &Key,
    body: &Node,
    context: &ReadContext<'_>,
) -> Option<(&'static str, Arc<dyn Action>)> {
    match kind(&key.name) {
        Some(kind) => Some((kind.name, (kind.read)(body, context)?)),
        None => {
            context.problems.add(
                key.span,
                format!("there is no kind of step `{}`", key.name),
                meant(&key.name),
            );
            None
        }
    }
}

/// What a name that is no kind's may have been meant for.
fn meant(name: &str) -> String {
    did_you_mean(name, KINDS.iter().map(|kind| kind.name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_a_name_of_its_own_a_sentence_and_a_schema() {
        for (index, kind) in KINDS.iter().enumerate() {
            assert!(KINDS.iter().skip(index + 1).all(|other| other.name != kind.name), "{}", kind.name);
            assert!(kind.sentence.len() > 10 && !kind.sentence.ends_with('.'), "{}", kind.name);
            let schema: serde_json::Value = serde_json::from_str(kind.schema).expect(kind.name);
            assert!(schema.is_object(), "{}", kind.name);
        }
        assert_eq!(kind("search").map(|kind| kind.name), Some("search"));
        assert!(kind("serach").is_none());
    }

    #[test]
    fn a_name_that_is_no_kinds_is_answered_with_the_nearest_or_all_there_are() {
        assert_eq!(meant("serach"), "did you mean `search`?");
        let all = meant("pirouette");
        assert!(KINDS.iter().all(|kind| all.contains(&format!("`{}`", kind.name))), "{all}");
    }
}
