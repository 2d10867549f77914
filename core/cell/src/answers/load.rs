//! From an answers file to what it says.

use std::path::Path;

use super::check::check_answers;
use super::{AnswerEntry, Answers, Given, WrittenAnswer};
use crate::event::NamedValue;
use crate::procedure::Procedure;
use crate::prompt::Decision;
use plumb_document::{
    DocumentKind, FileKind, FileProblems, Key, MapReader, Node, NodeValue, Problems, parse_as, read_document,
};

/// Reads an answers file and checks it against the procedures it may be used for; with none, only its form is checked.
///
/// # Errors
/// Every mistake in it.
pub fn load_answers(file: &Path, procedures: &[&Procedure]) -> Result<Answers, FileProblems> {
    let text = read_document(file, FileKind::CELL)?;
    let problems = Problems::default();
    let root = parse_as(DocumentKind::Answers, file, &text, &problems)?;
    let answers = read(&root, file, &text, &problems);
    if let Some(answers) = answers.as_ref().filter(|_| !procedures.is_empty()) {
        check_answers(answers, procedures, &problems);
    }
    problems.into_result(file, &text)?;
    answers.ok_or_else(|| FileProblems::whole_file(file, "this is no answers file", ""))
}

fn read(root: &Node, file: &Path, text: &str, problems: &Problems) -> Option<Answers> {
    let mut map = MapReader::new(root, "an answers file", problems)?;
    let entries =
        map.required("answers").and_then(|node| node.entries("`answers`", problems)).unwrap_or_default();
    let by = map.optional("by").and_then(|node| node.text("`by`", problems)).unwrap_or("answers file");
    let on_error =
        map.optional("on_error").and_then(|node| node.entries("`on_error`", problems)).unwrap_or_default();
    let confirm_pose = map.optional("confirm_pose").and_then(|node| node.boolean("`confirm_pose`", problems));
    map.finish();
    let decision = |(step, node): &(Key, Node)| {
        let index = node.word("decision", &["retry", "skip", "abort"], problems)?;
        let decision = [Decision::Retry, Decision::Skip, Decision::Abort].get(index).copied()?;
        Some((step.name.clone(), decision, step.span))
    };
    Some(Answers {
        file: file.to_owned(),
        text: text.to_owned(),
        by: by.to_owned(),
        entries: entries.iter().filter_map(|(step, node)| read_entry(step, node, problems)).collect(),
        on_error: on_error.iter().filter_map(decision).collect(),
        confirm_pose: confirm_pose.unwrap_or(false),
    })
}

fn read_entry(step: &Key, node: &Node, problems: &Problems) -> Option<AnswerEntry> {
    let given = match &node.value {
        NodeValue::List(items) => {
            Given::InTurn(items.iter().filter_map(|item| read_answer(item, problems)).collect())
        }
        _ => Given::Always(read_answer(node, problems)?),
    };
    Some(AnswerEntry { step: step.name.clone(), place: step.span, given })
}

fn read_answer(node: &Node, problems: &Problems) -> Option<WrittenAnswer> {
    match &node.value {
        NodeValue::Text(word) => Some(WrittenAnswer::Word(word.clone())),
        NodeValue::Bool(word) => Some(WrittenAnswer::Word(word.to_string())),
        NodeValue::Number(_) => node.number("an answer", problems).map(WrittenAnswer::Number),
        NodeValue::Map(_) => {
            let mut map = MapReader::new(node, "a pose", problems)?;
            let mut joints = Vec::new();
            for (key, unit) in [("pose_deg", "deg"), ("pose_mm", "mm")] {
                let entries =
                    map.optional(key).and_then(|node| node.entries("a pose", problems)).unwrap_or_default();
                for (joint, node) in entries {
                    let value = node.number("a joint's place", problems)?;
                    joints.push(NamedValue {
                        name: joint.name.clone(),
                        value,
                        unit: unit.to_owned(),
                        uncertainty: None,
                    });
                }
            }
            map.finish();
            Some(WrittenAnswer::Pose(joints))
        }
        other => {
            let message = format!("an answer is a word, a number or a pose; this is {}", other.kind());
            problems.add(
                node.span,
                message,
                "write `done`, the key of a choice, a number, or `{pose_deg: {shoulder: 45}}`",
            );
            None
        }
    }
}
