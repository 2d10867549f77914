"use strict";
// The page of `plumb serve`: what the cells do, live, and answers to their prompts. All text comes as text, never as markup.

const RENEW_MS = 10000; // a third of the time that a lease holds
const byId = (id) => document.getElementById(id);
let state = null;
let lease = null;
let renewing = null;
let drawings = {}; // what there is to be seen of a run, by its number and state, and the pictures themselves, so that they are not drawn anew
let drafts = {}; // what was typed for a prompt, by its number, so that a new state does not take it away

function element(tag, properties, ...children) {
  const made = Object.assign(document.createElement(tag), properties || {});
  for (const child of children) if (child !== null && child !== undefined) made.append(child);
  return made;
}

async function ask(method, path, body) {
  const answer = await fetch(path, {
    method,
    headers: { "Content-Type": "application/json", Authorization: "Bearer " + byId("token").value.trim() },
    body: JSON.stringify(body),
  });
  const text = await answer.text();
  let said = {};
  try { said = text ? JSON.parse(text) : {}; } catch { said = { error: text }; }
  if (!answer.ok) throw new Error(said.error || answer.statusText);
  return said;
}

function showTrouble(text) { byId("trouble").textContent = text; }

async function takeLease(event) {
  if (event) event.preventDefault();
  try {
    const given = await ask("POST", "api/lease", { name: byId("name").value, lease });
    lease = given.lease;
    showTrouble("");
    if (!renewing) renewing = setInterval(takeLease, RENEW_MS);
  } catch (error) {
    dropLease();
    showTrouble(error.message);
  }
  show();
}

function dropLease() {
  lease = null;
  clearInterval(renewing);
  renewing = null;
}

async function giveBack() {
  const held = lease;
  dropLease();
  try { await ask("DELETE", "api/lease", { name: byId("name").value, lease: held }); } catch (error) { showTrouble(error.message); }
  show();
}

async function give(cell, answer) {
  showTrouble("");
  for (const button of document.querySelectorAll(".prompt button")) button.disabled = true;
  try {
    await ask("POST", "api/answer", { lease, run: cell.run, prompt: cell.prompt.id, answer: String(answer) });
    delete drafts[cell.prompt.id];
  } catch (error) { showTrouble(error.message); }
  show();
}

// A prompt's text: sentences, and drawings whose lines keep their columns. A line of a drawing has two spaces in a row; no sentence has.
function promptText(text) {
  const parts = [];
  for (const line of text.split("\n")) {
    const drawn = /  /.test(line.trimEnd());
    const last = parts[parts.length - 1];
    if (last && (last.drawn === drawn || !line.trim())) last.lines.push(line);
    else parts.push({ drawn, lines: [line] });
  }
  return parts.map((part) => part.drawn ? element("pre", { className: "drawing", textContent: part.lines.join("\n").trimEnd() })
    : element("p", { textContent: part.lines.join("\n").trim() }));
}

function answers(cell) {
  const prompt = cell.prompt;
  if (prompt.only_at_the_arm) return element("p", { textContent: prompt.only_at_the_arm });
  if (!state.answers) return element("p", { textContent: "This page can only be read." });
  if (!lease) return element("p", { textContent: "To answer, write your name and the token above, and take the lease." });
  const button = (label, answer) => element("button", { type: "button", textContent: label, onclick: () => give(cell, answer) });
  const kind = prompt.kind;
  const simulate = prompt.simulate ? button("Leave this and everything like it to the program", prompt.simulate) : null;
  if (kind.kind === "acknowledge") return element("div", {}, button(kind.label || "Done", "done"), simulate);
  if (kind.kind === "choice") return element("div", {}, ...kind.options.map((option) => button(option.label, option.key)));
  if (kind.kind === "decision") return element("div", {}, ...kind.options.map((option) => button(option, option)));
  const input = element("input", { id: "answer-" + prompt.id, value: drafts[prompt.id] || "", inputMode: kind.kind === "number" ? "decimal" : "text" });
  input.oninput = () => { drafts[prompt.id] = input.value; };
  const form = element("form", {}, element("label", {}, prompt.answer_with, input), element("button", { textContent: "Answer" }));
  form.onsubmit = (event) => { event.preventDefault(); give(cell, input.value); };
  return simulate ? element("div", {}, form, simulate) : form;
}

function number(value) { return value === null ? "not determined" : Number(value.toPrecision(6)).toString(); }

function correctionTable(cell) {
  const head = element("tr", {}, ...["what", "was", "found", "uncertainty", ""].map((text) => element("th", { textContent: text })));
  const rows = cell.corrections.map((one) => element("tr", {},
    element("td", { textContent: `${one.device}.${one.place} ${one.quantity.replaceAll("_", " ")}` }),
    element("td", { className: "number", textContent: number(one.old) }),
    element("td", { className: "number", textContent: `${number(one.new)} ${one.unit}` }),
    element("td", { className: "number", textContent: number(one.uncertainty) }),
    element("td", { textContent: one.in_force ? "used" : "proposed" })));
  return element("table", {}, head, ...rows);
}

function article(cell) {
  const state_line = element("p", {}, element("span", { className: "state " + cell.state, textContent: cell.state.replaceAll("_", " ") }),
    ` · run ${cell.run}, ${cell.title || cell.procedure} · ${cell.operator} · since ${(cell.ended || cell.started).slice(0, 19).replace("T", " ")} UTC`);
  const made = element("article", { id: "cell-" + cell.run }, element("h2", { textContent: cell.cell }), state_line);
  if (cell.message) made.append(element("p", { textContent: cell.message }));
  if (cell.prompt) {
    made.append(element("div", { className: "prompt" }, element("h3", { textContent: cell.prompt.title }), ...promptText(cell.prompt.text), answers(cell)));
  }
  if (cell.corrections.length) made.append(element("h3", { textContent: "Corrections" }), correctionTable(cell));
  const done = cell.steps.filter((step) => step.outcome && step.outcome !== "running").length;
  const list = element("ol", {}, ...cell.steps.map((step) => element("li", {}, step.title,
    step.outcome ? element("span", { className: step.outcome, textContent: " · " + step.outcome.replaceAll("_", " ") }) : null)));
  const open = document.querySelector(`#cell-${cell.run} details`);
  made.append(element("details", { open: open ? open.open : cell.state === "running" }, element("summary", { textContent: `Steps: ${done} of ${cell.steps.length}` }), list));
  if (cell.queued.length) made.append(element("p", { textContent: `Queued: ${cell.queued.join(", ")}` }));
  const seen = pictures(cell);
  if (seen) made.append(seen);
  if (cell.log.length) made.append(element("h3", { textContent: "Log" }), element("pre", { textContent: cell.log.map((line) => `${line.time.slice(11, 19)} ${line.message}`).join("\n") }));
  return made;
}

function image(source, text) {
  const picture = element("img", { src: source, alt: text, loading: "lazy" });
  picture.onerror = () => picture.replaceWith(element("p", { textContent: "It cannot be drawn." }));
  return element("figure", {}, element("figcaption", { textContent: text }), picture);
}

async function look(key, cell) {
  drawings[key] = null;
  try {
    const answer = await fetch(`api/drawings?run=${cell.run}`);
    if (!answer.ok) return;
    const list = await answer.json();
    const falls = list.models.map((one) => image(`api/fall.svg?run=${cell.run}&model=${one.model}`, `How the error of ${one.name} fell, RMS of each fit`));
    const clouds = list.clouds.map((name) => image(`api/cloud.png?run=${cell.run}&name=${encodeURIComponent(name)}`, name));
    if (falls.length + clouds.length) drawings[key] = element("section", {}, element("h3", { textContent: "Pictures" }), ...falls, ...clouds);
    show();
  } catch { delete drawings[key]; }
}

function pictures(cell) {
  const key = `${cell.run} ${cell.state}`;
  if (!(key in drawings)) look(key, cell);
  return drawings[key];
}

function show() {
  if (!state) return;
  const focus = document.activeElement && document.activeElement.id;
  const cells = state.cells.map(article);
  byId("cells").replaceChildren(...(cells.length ? cells : [element("p", { textContent: "No run yet: `plumb run CELL` starts one." })]));
  byId("answering").hidden = !state.answers;
  byId("give-back").hidden = !lease;
  byId("holder").textContent = state.holder ? `${state.holder} may answer now.` : "";
  const waiting = state.cells.filter((cell) => cell.prompt).length;
  document.title = waiting ? `(${waiting}) plumb waits` : "plumb";
  if (focus && byId(focus)) byId(focus).focus();
}

function connect() {
  const source = new EventSource("api/events");
  source.addEventListener("state", (event) => { state = JSON.parse(event.data); byId("connection").textContent = "live"; show(); });
  source.onerror = () => { byId("connection").textContent = "no connection: what is shown is old; trying again"; };
}

byId("sign-in").addEventListener("submit", takeLease);
byId("give-back").addEventListener("click", giveBack);
// The stream never ends: begun before the page has loaded, it would keep the browser loading for ever.
window.addEventListener("load", () => setTimeout(connect, 0));
