"use strict";

// The page of one skin. It asks for pictures, and sends actions, as small JSON objects.
// Text is only ever set as text, so that no label can become a part of the page.

const $ = (id) => document.getElementById(id);
const query = location.search;
let latest = null;
let list = { trials: [], total: 0, all: 0, words: [], doubts: [] };
let trials = [];
let start = 0;
let version = null;
let askedAt = 0;

// A text that stays as it is can be selected, and is not read out again.
function say(id, text) {
  if ($(id).textContent !== text) $(id).textContent = text;
}

function element(tag, text, className) {
  const node = document.createElement(tag);
  if (text !== undefined) node.textContent = text;
  if (className) node.className = className;
  return node;
}

function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function canvas(id, height) {
  const node = $(id);
  const ratio = devicePixelRatio || 1;
  const width = node.clientWidth;
  if (height) node.style.height = height + "px";
  const tall = height || node.clientHeight;
  if (node.width !== Math.round(width * ratio) || node.height !== Math.round(tall * ratio)) {
    node.width = Math.round(width * ratio);
    node.height = Math.round(tall * ratio);
  }
  const pen = node.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, tall);
  return [pen, width, tall];
}

// From red over orange to pale yellow: brightness alone tells the force.
function heatStops() {
  return ["--weak", "--middle", "--strong"].map((name) =>
    [1, 3, 5].map((at) => parseInt(colour(name).slice(at, at + 2), 16)));
}

function heat(stops, part) {
  const at = Math.min(Math.max(part, 0), 1) * (stops.length - 1);
  const low = Math.min(Math.floor(at), stops.length - 2);
  const mixed = stops[low].map((value, i) => Math.round(value + (at - low) * (stops[low + 1][i] - value)));
  return `rgb(${mixed.join(",")})`;
}

function drawSkin(picture) {
  const { rows, cols, counts, threshold, scale } = picture;
  const width = $("skin").clientWidth;
  const side = Math.max(4, Math.min(width / cols, 420 / rows));
  const [pen] = canvas("skin", Math.ceil(side * rows));
  const left = (width - side * cols) / 2;
  const touched = new Set(picture.contact ? picture.contact.taxels : []);
  const invalid = new Set(picture.invalid);
  const dead = new Set(picture.dead);
  const floor = Math.max(threshold, 1);
  const top = Math.max(scale > 1 ? 17 * scale : 50 * floor, floor + 2);
  const full = Math.log(top / floor);
  const stops = heatStops();
  const rest = [colour("--rest-low"), colour("--rest-high")];
  say("scale", `in contact, from ${shortNumber(floor / scale)} to ${shortNumber(top / scale)} ${picture.units.force}s`);
  for (let i = 0; i < counts.length; i++) {
    const x = left + (i % cols) * side;
    const y = Math.floor(i / cols) * side;
    const count = counts[i];
    if (dead.has(i)) pen.fillStyle = colour("--dead");
    else if (invalid.has(i)) pen.fillStyle = colour("--invalid");
    else if (count > threshold) pen.fillStyle = heat(stops, Math.log(count / floor) / full);
    else pen.fillStyle = count * 2 > threshold ? rest[1] : rest[0];
    pen.fillRect(x + 0.5, y + 0.5, side - 1, side - 1);
    if (dead.has(i)) {
      pen.strokeStyle = colour("--line");
      pen.beginPath();
      pen.moveTo(x + 1, y + side - 1);
      pen.lineTo(x + side - 1, y + 1);
      pen.stroke();
    }
  }
  pen.strokeStyle = colour("--edge");
  pen.lineWidth = 2;
  pen.beginPath();
  for (const i of touched) {
    const row = Math.floor(i / cols), col = i % cols;
    const x = left + col * side, y = row * side;
    if (!touched.has(i - cols)) { pen.moveTo(x, y); pen.lineTo(x + side, y); }
    if (!touched.has(i + cols)) { pen.moveTo(x, y + side); pen.lineTo(x + side, y + side); }
    if (col === 0 || !touched.has(i - 1)) { pen.moveTo(x, y); pen.lineTo(x, y + side); }
    if (col === cols - 1 || !touched.has(i + 1)) { pen.moveTo(x + side, y); pen.lineTo(x + side, y + side); }
  }
  pen.stroke();
  if (picture.shear) drawShear(pen, picture, touched, left, side);
  say("seam", picture.wraps ?
    "Rows run down, from elbow to wrist. The last column touches the first." :
    "Rows run down, columns to the right.");
}

// A line from the middle of each taxel in contact: its shear, half a taxel for the strongest.
function drawShear(pen, { cols, shear }, touched, left, side) {
  let longest = 1;
  for (const i of touched) longest = Math.max(longest, Math.hypot(...shear[i]));
  pen.strokeStyle = colour("--arrow");
  pen.fillStyle = colour("--arrow");
  pen.lineWidth = Math.max(1, side / 12);
  for (const i of touched) {
    const x = left + ((i % cols) + 0.5) * side;
    const y = (Math.floor(i / cols) + 0.5) * side;
    const [along, around] = shear[i].map((value) => (value / longest) * 0.5 * side);
    pen.beginPath();
    pen.arc(x, y, pen.lineWidth, 0, 2 * Math.PI);
    pen.fill();
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x + around, y + along);
    pen.stroke();
  }
}

function drawCurve(id, name, unit, t, values) {
  const [pen, width, height] = canvas(id);
  const numbers = values.filter((value) => value !== null);
  const most = Math.max(...numbers, 0);
  const end = Math.max(1.2, t.length ? t[t.length - 1] : 0);
  const left = 8, right = width - 8, top = 24, bottom = height - 18;
  pen.font = "13px system-ui, sans-serif";
  pen.fillStyle = colour("--text");
  pen.fillText(`${name}, ${unit}`, left, 14);
  const now = numbers.length ? numbers[numbers.length - 1] : 0;
  pen.textAlign = "right";
  pen.fillText(`${shortNumber(now)} now`, right, 14);
  pen.fillStyle = colour("--quiet");
  pen.fillText(`${end.toFixed(1)} s after onset`, right, height - 4);
  pen.textAlign = "left";
  pen.fillText("0 s", left, height - 4);
  if (most > 0) pen.fillText(`top of the box: ${shortNumber(most)}`, left + 40, height - 4);
  pen.strokeStyle = colour("--line");
  pen.lineWidth = 1;
  pen.strokeRect(left, top, right - left, bottom - top);
  pen.strokeStyle = colour("--curve");
  pen.lineWidth = 2;
  pen.beginPath();
  let begun = false;
  values.forEach((value, i) => {
    if (value === null) { begun = false; return; }
    const x = left + (t[i] / end) * (right - left);
    const y = bottom - (most > 0 ? value / most : 0) * (bottom - top);
    if (begun) pen.lineTo(x, y); else pen.moveTo(x, y);
    begun = true;
  });
  pen.stroke();
}

function shortNumber(value) {
  return Number(value.toPrecision(3)).toString();
}

function drawContact(picture) {
  const contact = picture.contact;
  const seconds = contact && contact.t.length ? contact.t[contact.t.length - 1] : 0;
  say("contact", !contact ? "No contact yet."
    : contact.ended ? `The last contact ended after ${seconds.toFixed(2)} s.`
    : `In contact for ${seconds.toFixed(2)} s.`);
  const t = contact ? contact.t : [];
  drawCurve("force", "largest force", picture.units.force, t, contact ? contact.force : []);
  drawCurve("area", "area", "taxels", t, contact ? contact.area : []);
  drawCurve("motion", "motion on the skin", picture.units.motion, t, contact ? contact.motion : []);
}

function drawDecisions(picture) {
  const box = $("decisions");
  $("decision-part").hidden = !picture.decides && !picture.decisions.length;
  $("waiting").hidden = picture.decisions.length > 0;
  say("waiting", picture.contact && !picture.contact.ended
    ? "Waiting for the window to end." : "No decision yet.");
  const shown = JSON.stringify(picture.decisions);
  if (box.dataset.shown === shown) return;
  box.dataset.shown = shown;
  box.replaceChildren(...picture.decisions.map((decision) => {
    const item = element("div", undefined, "decision");
    item.append(element("div", `${decision.task}, after ${decision.window_s} s`, "task"));
    item.append(element("strong", labelOf(decision)));
    if (decision.label !== null && decision.confidence !== null) {
      item.append(document.createTextNode(` ${Math.round(100 * decision.confidence)} %`));
      const meter = element("meter");
      meter.value = decision.confidence;
      meter.setAttribute("aria-label", "confidence");
      item.append(meter);
    }
    for (const flag of decision.flags) item.append(element("span", flag, "flag"));
    if (decision.neighbours.length) {
      const near = decision.neighbours.map(([name, distance]) => `${name} (${distance})`);
      item.append(element("div", "nearest: " + near.join(", "), "near"));
    }
    return item;
  }));
}

function post(action) {
  return fetch("action" + query, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(action),
  }).catch(() => null);
}

function button(text, action, label) {
  const node = element("button", text);
  node.type = "button";
  node.onclick = action;
  if (label) node.setAttribute("aria-label", label);
  return node;
}

function field(name, label, action) {
  const input = element("input");
  input.placeholder = name;
  input.maxLength = 80;
  input.setAttribute("aria-label", label);
  input.onchange = action;
  return input;
}

function message(node, text, hide) {
  const close = button("×", hide, "hide this message");
  node.replaceChildren(text, close);
  setTimeout(() => close.isConnected && hide(), 60000); // a later message keeps its own minute
  return node;
}

// One action after another: a label that is still being written comes before Record.
let acted = Promise.resolve();

function act(action) {
  acted = acted.then(() => send(action));
  return acted;
}

async function send(action) {
  const answer = await post(action);
  const failed = !answer || !answer.ok;
  $("error").hidden = !failed;
  if (failed) {
    const text = answer && await answer.text();
    message($("error"), text || "The program did not answer.", () => { $("error").hidden = true; });
  }
  return !failed;
}

function tasksOf(touches) {
  return touches.flatMap((trial) => [...Object.keys(trial.labels), ...Object.keys(trial.decided)]);
}

// A task's labels as buttons, the fixed ones first, with a field for a new one.
function taskGroup(task, choose) {
  const group = element("fieldset");
  group.dataset.task = task;
  group.append(element("legend", task));
  const fixed = latest.choices[task] || [];
  const used = list.words.map(([word]) => word).filter((word) => word.startsWith(task + "="))
    .map((word) => word.slice(task.length + 1));
  for (const name of new Set([...fixed, ...used])) {
    const node = button(name, () => choose(task, name));
    node.dataset.label = name;
    if (fixed.includes(name)) node.className = "fixed";
    group.append(node);
  }
  const input = field("new", `new label for ${task}`, () => input.value.trim() && choose(task, input.value.trim()));
  group.append(input);
  return group;
}

function mark(group, label) {
  const input = group.querySelector("input");
  let text = label || "";
  for (const node of group.querySelectorAll("[data-label]")) {
    node.setAttribute("aria-pressed", node.dataset.label === label);
    if (node.dataset.label === label) text = "";
  }
  if (input !== document.activeElement) input.value = text;
}

function newTask(choose) {
  const box = element("details");
  const add = () => {
    if (!task.value.trim() || !label.value.trim()) return;
    choose(task.value.trim(), label.value.trim());
    task.value = label.value = "";
    box.open = false;
  };
  const task = field("task", "new task", add);
  const label = field("label", "its label", add);
  box.append(element("summary", "Add a task"), task, " ", label);
  return box;
}

// The digits press fixed labels: a new label moves no digit to another one.
function setDigits(box) {
  [...box.querySelectorAll(".fixed")].slice(0, 9).forEach((node, i) => {
    node.dataset.key = i + 1;
    node.textContent = `${i + 1} ${node.dataset.label}`;
  });
}

// A form for the labels of touches in the list, apart from those of the next touch. It changes them
// only if they still stand as they did when it was opened.
function edit(place, touched) {
  document.querySelectorAll(".editor").forEach((other) => other.remove());
  const labels = {};
  const groups = {};
  const form = element("form", undefined, "editor");
  const choose = (task, label) => {
    labels[task] = label;
    if (!groups[task]) form.prepend(groups[task] = taskGroup(task, choose));
    mark(groups[task], label);
  };
  for (const task of new Set([...Object.keys(latest.choices), ...tasksOf(touched)])) {
    const former = new Set(touched.map((trial) => trial.labels[task]));
    form.append(groups[task] = taskGroup(task, choose));
    mark(groups[task], former.size === 1 ? [...former][0] : undefined);
  }
  setDigits(form);
  const buttons = element("p", undefined, "buttons");
  buttons.append(element("button", "Save"), button("Cancel", () => form.remove()));
  form.append(newTask(choose), buttons);
  form.onsubmit = async (event) => {
    event.preventDefault();
    for (const input of form.querySelectorAll("input")) input.onchange();
    if (Object.keys(labels).length && !await change("relabel", touched, { labels })) return;
    form.remove();
    if (place === $("ticked")) tickAll(false);
  };
  place.append(form);
  form.querySelector("button, input").focus();
}

function labelText(labels) {
  return Object.entries(labels).map(([task, label]) => `${task}=${label}`).join(", ");
}

// The labels of the next touch, which change here alone; every browser shows the program's.
function drawForm(picture) {
  const box = $("choices");
  const choose = (task, label) => act({ do: "labels", labels: { [task]: label } });
  const tasks = new Set([...Object.keys(picture.choices), ...Object.keys(picture.labels)]);
  if (!tasks.size) tasks.add("object");
  const groups = [...tasks].map((task) => taskGroup(task, choose));
  const shape = groups.map((group) => group.innerHTML).join();
  if (box.dataset.shape !== shape && !box.querySelector("input:focus, [open]")) {
    box.dataset.shape = shape;
    for (const group of groups) {
      const { task } = group.dataset;
      group.append(button("−", () => act({ do: "unlabel", task }), `no label for ${task}`));
    }
    box.replaceChildren(...groups, newTask(choose));
    setDigits(box);
  }
  const decided = Object.fromEntries(picture.decisions.map((it) => [it.task, `decided: ${answerText(it)}`]));
  for (const group of box.querySelectorAll("fieldset")) {
    const task = group.dataset.task;
    mark(group, picture.labels[task]);
    const text = task in decided ? `${task}, ${decided[task]}` : task;
    if (group.firstChild.textContent !== text) group.firstChild.textContent = text;
  }
}

function drawRecord(picture) {
  const records = picture.folder !== null && !picture.decides;
  $("next").hidden = $("record-part").hidden = !records;
  $("touches-part").hidden = picture.folder === null;
  if (picture.folder === null) return;
  if (records) {
    drawForm(picture);
    const what = labelText(picture.labels);
    $("record").setAttribute("aria-pressed", picture.recording);
    say("record", picture.recording ? "Stop" : "Record");
    say("recording", picture.waits.length ? `Choose ${picture.waits.join(" and ")} to begin.`
      : !what ? "Give a label, then record."
      : picture.recording ? `Each touch is saved as ${what}.` : `Not recording. The next touch would be ${what}.`);
  }
  say("folder", `${list.all} ${list.all === 1 ? "touch" : "touches"} in ${picture.folder}.`);
  if (picture.trials !== version || performance.now() - askedAt > 2000) fetchTrials(picture.trials);
}

async function fetchTrials(number) {
  version = number;
  askedAt = performance.now();
  const asked = { only: $("filter").value, start };
  const answer = await post({ do: "trials", ...asked });
  if (!answer || !answer.ok || asked.only !== $("filter").value || asked.start !== start) return;
  list = await answer.json();
  trials = list.trials;
  if (start && !trials.length) turn(0);
  $("doubts").replaceChildren(...list.doubts.map((text) => element("li", text)));
  drawUndo(list.undo);
  drawTrials();
}

// Fifty touches at a time, the newest first.
function turn(to) {
  start = Math.max(to, 0);
  $("trials").replaceChildren();
  fetchTrials(version);
}

function drawFilter() {
  const text = JSON.stringify(list.words);
  if ($("filter").dataset.words === text) return;
  const chosen = $("filter").value;
  $("filter").dataset.words = text;
  const words = new Map([["", list.all], ...["unsure", "wrong", "unlabelled", "left_out"].map((kind) => [kind, 0]),
    ...list.words]);
  if (!words.has(chosen)) words.set(chosen, 0);
  const options = [...words].map(([word, count]) => {
    const option = element("option", `${word || "all touches"} (${count})`);
    option.value = word;
    return option;
  });
  $("filter").replaceChildren(...options);
  $("filter").value = chosen;
}

function drawTurns() {
  const last = start + trials.length;
  say("range", list.total > list.trials.length ? `${start + 1} to ${last} of ${list.total}` : "");
  $("newer").hidden = !start;
  $("older").hidden = last >= list.total;
}

function labelOf({ label, flags }) {
  return label ?? (flags.includes("unknown") ? "unknown" : "out of range");
}

function answerText(answer) {
  const { label, confidence, flags } = answer;
  const sure = label === null || confidence === null ? [] : [`${Math.round(100 * confidence)} %`];
  const notes = [...sure, ...flags].join(", ");
  return labelOf(answer) + (notes ? ` (${notes})` : "");
}

function smallCurve(percent) {
  const svg = $("small").content.firstElementChild.cloneNode(true);
  const last = Math.max(percent.length - 1, 1);
  const points = percent.map((value, i) => `${(100 * i) / last},${100 - value}`);
  svg.firstElementChild.setAttribute("points", points.join(" "));
  return svg;
}

function breaking(tag, text, className) {
  const node = element(tag, undefined, className);
  for (const part of text.split(/(?<=[-_])/)) node.append(part, element("wbr"));
  return node;
}

// A row is made anew only where its touch has changed, and new touches come in when neither the
// pointer nor the focus is in the list: nothing moves under them, and what is written stays.
function drawTrials() {
  drawFilter();
  drawTurns();
  const box = $("trials");
  const focused = document.activeElement.closest("#trials > li");
  const place = focused && [...box.children].indexOf(focused);
  const name = document.activeElement.textContent;
  const former = new Map([...box.children].map((row) => [row.dataset.file, row]));
  const still = former.size > 0 && box.matches(":hover, :focus-within");
  const rows = trials.filter((trial) => !still || former.has(trial.file)).map((trial) => {
    const row = former.get(trial.file);
    if (row && row.dataset.text === JSON.stringify(trial)) return row;
    const fresh = trialRow(trial);
    const form = row && row.querySelector(".editor");
    if (form) fresh.append(form);
    if (row) fresh.firstChild.checked = row.firstChild.checked;
    return fresh;
  });
  const present = new Set(rows);
  for (const row of [...box.children]) if (!present.has(row)) row.remove();
  rows.forEach((row, i) => { if (box.children[i] !== row) box.insertBefore(row, box.children[i] || null); });
  drawTicked();
  if (!focused || box.contains(focused) || !rows.length) return;
  const buttons = [...rows[Math.min(place, rows.length - 1)].querySelectorAll("button")];
  (buttons.find((button) => button.textContent === name) || buttons[0]).focus();
}

function ticked() {
  return [...document.querySelectorAll("#trials > li > input:checked")]
    .map((tick) => JSON.parse(tick.parentNode.dataset.text));
}

function tickAll(on) {
  for (const tick of document.querySelectorAll("#trials > li > input")) tick.checked = on;
  drawTicked();
}

function drawTicked() {
  const touches = ticked();
  $("ticked").hidden = !touches.length;
  $("all").checked = touches.length > 0 && touches.length === $("trials").children.length;
  say("number", `${touches.length} ticked:`);
  $("accept-ticked").hidden = !touches.some(canAccept);
}

function canAccept(trial) {
  return Object.keys(trial.accepted).length > 0;
}

// What a person saw goes with the change, so that it cannot undo what another has written since.
function change(what, touches, more) {
  const seen = touches.map(({ file, labels, left_out }) => ({ file, labels, left_out }));
  return act({ do: what, touches: seen, ...more });
}

function trialRow(trial) {
  const row = element("li");
  row.dataset.text = JSON.stringify(trial);
  row.dataset.file = trial.file;
  const tick = element("input");
  tick.type = "checkbox";
  tick.setAttribute("aria-label", `tick ${trial.file}`);
  tick.onchange = drawTicked;
  const buttons = element("div", undefined, "buttons");
  if (canAccept(trial)) {
    const accept = button("Accept", () => change("accept", [trial]));
    accept.title = labelText(trial.accepted);
    buttons.append(accept);
  }
  const decided = Object.entries(trial.decided);
  buttons.append(
    button(decided.length ? "Correct" : "Relabel", () => edit(row, [trial])),
    trial.left_out ? button("Put back", () => change("put_back", [trial]))
      : button("Leave out", () => change("leave_out", [trial])),
  );
  const text = element("div");
  text.append(breaking("strong", labelText(trial.labels) || "no label"));
  text.append(breaking("div", `${trial.file}, ${trial.seconds.toFixed(2)}\u00a0s`, "near"));
  for (const [task, answer] of decided) text.append(element("div", `${task}: ${answerText(answer)}`, "near"));
  for (const kind of trial.kinds) text.append(element("span", kind, "flag"));
  for (const doubt of trial.doubts) text.append(element("div", doubt, "doubt"));
  row.append(tick, smallCurve(trial.curve), text, buttons);
  return row;
}

function drawUndo(last) {
  $("undo").hidden = !last;
  if (last) say("undo", `Undo: ${last.command}`);
}

// The notices are a stream's last: new are those that follow the former ones.
let notices = [];

function drawNotices(picture) {
  let former = notices;
  while (!former.every((text, i) => text === picture.notices[i])) former = former.slice(1);
  for (const text of picture.notices.slice(former.length)) {
    const notice = element("li");
    $("notices").append(message(notice, text, () => notice.remove()));
  }
  notices = picture.notices;
  $("notice-part").hidden = !$("notices").children.length;
}

function draw(picture) {
  latest = picture;
  say("title", picture.title);
  document.title = picture.title;
  $("state").className = "";
  const rate = picture.rate_hz ? `${picture.rate_hz} frames/s, ${picture.missed} missed, ` : "";
  say("state", `${rate}${picture.invalid.length} of ${picture.counts.length} taxels cannot be read`);
  drawSkin(picture);
  drawContact(picture);
  drawDecisions(picture);
  drawRecord(picture);
  drawNotices(picture);
}

$("undo").onclick = () => act({ do: "undo", time: list.undo.time });
$("all").onchange = () => tickAll($("all").checked);
$("accept-ticked").onclick = async () => await change("accept", ticked()) && tickAll(false);
$("label-ticked").onclick = () => edit($("ticked"), ticked());
$("leave-ticked").onclick = async () => await change("leave_out", ticked()) && tickAll(false);
$("filter").onchange = () => turn(0);
$("newer").onclick = () => turn(start - 50);
$("older").onclick = () => turn(start + 50);
$("trials").onmouseleave = drawTrials;
$("trials").addEventListener("focusout", () => setTimeout(drawTrials));
addEventListener("keydown", (event) => {
  const writes = event.target.matches("select, textarea, input:not([type=checkbox])");
  if (writes || event.ctrlKey || event.metaKey) return;
  const form = document.querySelector(".editor") || $("choices");
  const button = form.querySelector(`button[data-key="${event.key}"]`);
  if (button) button.click();
});
$("record").onclick = () => act({ do: "record", on: !(latest && latest.recording) });
addEventListener("resize", () => latest && draw(latest));

function watch() {
  const stream = new EventSource("events" + query);
  stream.onmessage = (event) => draw(JSON.parse(event.data));
  stream.onerror = () => {
    $("state").className = "lost";
    $("state").textContent = stream.readyState === EventSource.CLOSED
      ? "The program has started anew; open the link that it has printed."
      : "The program does not answer; trying again.";
  };
}
watch();
