//! From an answers file to what it says.

use std::path::Path;

use super::check::check_answers;
use super::{AnswerEntry, AnswerSpans, Answers, Given, WrittenAnswer};
use crate::event::NamedValue;
use crate::procedure::Procedure;
use crate::prompt::Decision;
use crate::workcell::RobotSetting;
use plumb_document::{
    DocumentKind, FileKind, FileProblems, Key, MapReader, Node, NodeValue, Problems, Span, parse_as,
    read_document,
};

/// Reads an answers file and checks it against the procedures it may be used for and the robots of their cell; with no procedures, only its form is checked.
///
/// # Errors
/// Every mistake in it.
pub fn load_answers(
    file: &Path,
    procedures: &[&Procedure],
    robots: &[RobotSetting],
) -> Result<Answers, FileProblems> {
    let text = read_document(file, FileKind::CELL)?;
    let problems = Problems::default();
    let root = parse_as(DocumentKind::Answers, file, &text, &problems)?;
    let answers = read(&root, file, &text, &problems);
    if let Some(answers) = answers.as_ref().filter(|_| !procedures.is_empty()) {
        check_answers(answers, procedures, robots, &problems);
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
    let (given, spans) = match &node.value {
        NodeValue::List(items) => {
            let read = items.iter().filter_map(|item| read_answer(item, problems));
            let (answers, spans): (Vec<WrittenAnswer>, Vec<AnswerSpans>) = read.unzip();
            (Given::InTurn(answers), spans)
        }
        _ => {
            let (answer, spans) = read_answer(node, problems)?;
            (Given::Always(answer), vec![spans])
        }
    };
    Some(AnswerEntry { step: step.name.clone(), span: step.span, given, spans })
}

/// An answer and where it is. Of a pose, what could not be read has been reported and is left out.
fn read_answer(node: &Node, problems: &Problems) -> Option<(WrittenAnswer, AnswerSpans)> {
    let mut spans = AnswerSpans { whole: node.span, joints: Vec::new() };
    let answer = match &node.value {
        NodeValue::Text(word) => WrittenAnswer::Word(word.clone()),
        NodeValue::Bool(word) => WrittenAnswer::Word(word.to_string()),
        NodeValue::Number(_) => WrittenAnswer::Number(node.number("an answer", problems)?),
        NodeValue::Map(_) => {
            let (joints, joint_spans) = read_pose(node, problems)?.into_iter().unzip();
            spans.joints = joint_spans;
            WrittenAnswer::Pose(joints)
        }
        other => {
            let message = format!("an answer is a word, a number or a pose; this is {}", other.kind());
            problems.add(
                node.span,
                message,
                "write `done`, the key of a choice, a number, or `{pose_deg: {shoulder: 45}}`",
            );
            return None;
        }
    };
    Some((answer, spans))
}

/// Joints and where they are to go, each with the span of its name.
fn read_pose(node: &Node, problems: &Problems) -> Option<Vec<(NamedValue, Span)>> {
    let mut map = MapReader::new(node, "a pose", problems)?;
    let mut joints = Vec::new();
    for (key, unit) in [("pose_deg", "deg"), ("pose_mm", "mm")] {
        let entries = map.optional(key).and_then(|node| node.entries("a pose", problems)).unwrap_or_default();
        for (joint, node) in entries {
            let Some(value) = node.number("a joint's place", problems) else { continue };
            let (name, unit) = (joint.name.clone(), unit.to_owned());
            joints.push((NamedValue { name, value, unit, uncertainty: None }, joint.span));
        }
    }
    map.finish();
    Some(joints)
}
