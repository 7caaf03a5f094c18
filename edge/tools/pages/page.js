"use strict";

// The page of one skin. It asks for pictures, and sends actions, as small JSON objects.
// Text is only ever set as text, so that no label can become a part of the page.

const $ = (id) => document.getElementById(id);
const query = location.search;
let latest = null;
let trials = [];
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
  const known = values.filter((value) => value !== null);
  const most = Math.max(...known, 0);
  const end = Math.max(1.2, t.length ? t[t.length - 1] : 0);
  const left = 8, right = width - 8, top = 24, bottom = height - 18;
  pen.font = "13px system-ui, sans-serif";
  pen.fillStyle = colour("--text");
  pen.fillText(`${name}, ${unit}`, left, 14);
  const now = known.length ? known[known.length - 1] : 0;
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

async function act(action) {
  const answer = await post(action);
  const failed = !answer || !answer.ok;
  $("error").hidden = !failed;
  if (failed) $("error").textContent = (answer && await answer.text()) || "The program did not answer.";
  return !failed;
}

function labelRow(task, label) {
  const row = element("div", undefined, "label-row");
  row.onchange = () => { row.dataset.task = changeLabel(row); };
  row.dataset.task = task;
  const inputs = [["task", task], ["label", label]].map(([name, value]) => {
    const input = element("input");
    input.placeholder = name;
    input.setAttribute("aria-label", name);
    input.value = value;
    input.maxLength = 80;
    return input;
  });
  const remove = element("button", "−");
  remove.type = "button";
  remove.setAttribute("aria-label", "remove this task");
  remove.onclick = () => { row.remove(); if (row.dataset.task) act({ do: "unlabel", task: row.dataset.task }); };
  row.append(...inputs, remove);
  $("label-rows").append(row);
}

function rowLabel(row) {
  return [...row.querySelectorAll("input")].map((input) => input.value.trim());
}

// A label applies as soon as it is chosen; returns the row's task.
function changeLabel(row) {
  const [task, label] = rowLabel(row);
  const former = row.dataset.task;
  if (!task || !label) {
    if (former in latest.labels) $("label-rows").dataset.shown = "";
    return former;
  }
  act({ do: "labels", labels: { [task]: label } })
    .then((done) => done && former && former !== task && act({ do: "unlabel", task: former }));
  return task;
}

// The program's labels, and those that have just been written into the form.
function chosenLabels() {
  const rows = [...$("label-rows").children].map(rowLabel);
  return { ...latest.labels, ...Object.fromEntries(rows.filter(([task, label]) => task && label)) };
}

// The rows of free text show the program's labels, whichever browser gave them.
function drawRows(picture) {
  const box = $("label-rows");
  const labels = Object.entries(picture.labels).filter(([task]) => !(task in picture.choices));
  if (!labels.length && !Object.keys(picture.choices).length) labels.push(["object", ""]);
  const text = JSON.stringify(labels);
  if (box.dataset.shown === text || box.contains(document.activeElement)) return;
  box.dataset.shown = text;
  box.replaceChildren();
  for (const [task, label] of labels) labelRow(task, label);
}

function labelText(labels) {
  return Object.entries(labels).map(([task, label]) => `${task}=${label}`).join(", ");
}

// Buttons for the labels of each task that has a fixed choice; a number presses one.
function drawChoices(picture) {
  const box = $("choices");
  const shape = JSON.stringify(picture.choices);
  if (box.dataset.shape !== shape) {
    box.dataset.shape = shape;
    let digit = 0;
    box.replaceChildren(...Object.entries(picture.choices).map(([task, names]) => {
      const group = element("fieldset");
      group.dataset.task = task;
      group.append(element("legend", task));
      for (const name of names) {
        digit += 1;
        const button = element("button", digit < 10 ? `${digit} ${name}` : name);
        button.type = "button";
        button.dataset.task = task;
        button.dataset.label = name;
        if (digit < 10) button.dataset.key = digit;
        button.onclick = () => act({ do: "labels", labels: { [task]: name } });
        group.append(button);
      }
      return group;
    }));
  }
  for (const button of box.querySelectorAll("button")) {
    button.setAttribute("aria-pressed", picture.labels[button.dataset.task] === button.dataset.label);
  }
  const decided = Object.fromEntries(picture.decisions.map((it) => [it.task, `decided: ${answerText(it)}`]));
  for (const group of box.children) {
    const task = group.dataset.task;
    const text = task in decided ? `${task}, ${decided[task]}` : task;
    if (group.firstChild.textContent !== text) group.firstChild.textContent = text;
  }
}

function drawRecord(picture) {
  $("record-part").hidden = picture.folder === null;
  if (picture.folder === null) return;
  $("record").hidden = picture.decides;
  drawChoices(picture);
  drawRows(picture);
  $("record").setAttribute("aria-pressed", picture.recording);
  say("record", picture.recording ? "Stop recording" : "Record");
  const what = labelText(picture.labels) || "no labels yet";
  const count = trials.length;
  const number = `${count} ${count === 1 ? "touch" : "touches"} in ${picture.folder}.`;
  const saved = picture.recording ? `Each contact is saved with ${what}; ` : `Contacts are not saved (${what}); `;
  say("recording", picture.decides ? number : saved + number);
  const late = picture.decides && performance.now() - askedAt > 2000;
  if (picture.trials !== version || late) fetchTrials(picture.trials);
}

// The list comes when it has changed; a folder that another thread fills is looked at again.
async function fetchTrials(number) {
  version = number;
  askedAt = performance.now();
  const answer = await post({ do: "trials" });
  if (!answer || !answer.ok) return;
  trials = await answer.json();
  drawTrials();
}

function shownTrials() {
  const kind = $("filter").value;
  const known = (trial) => [...trial.kinds, ...Object.keys(trial.labels), ...Object.keys(trial.decided)];
  return trials.filter((trial) => kind === "" || known(trial).includes(kind));
}

function drawFilter() {
  const tasks = trials.flatMap((trial) => [...Object.keys(trial.labels), ...Object.keys(trial.decided)]);
  const names = ["unsure", "wrong", "unlabelled", ...new Set(tasks)];
  const text = JSON.stringify(names);
  if ($("filter").dataset.names === text) return;
  const chosen = $("filter").value;
  $("filter").dataset.names = text;
  const options = ["", ...names].map((name) => {
    const option = element("option", name || "all touches");
    option.value = name;
    return option;
  });
  $("filter").replaceChildren(...options);
  $("filter").value = ["", ...names].includes(chosen) ? chosen : "";
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
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 100 100");
  svg.setAttribute("preserveAspectRatio", "none");
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", "largest force over time");
  const line = document.createElementNS("http://www.w3.org/2000/svg", "polyline");
  const last = Math.max(percent.length - 1, 1);
  line.setAttribute("points", percent.map((value, i) => `${(100 * i) / last},${100 - value}`).join(" "));
  svg.append(line);
  return svg;
}

// New touches come last, and a row is made anew only where its touch has changed: nothing moves
// under the pointer, and the focus stays at its button.
function drawTrials() {
  drawFilter();
  const body = $("trials");
  const focused = document.activeElement.closest("#trials tr");
  const place = focused && focused.sectionRowIndex;
  const name = document.activeElement.textContent;
  const former = new Map([...body.rows].map((row) => [row.dataset.text, row]));
  const rows = shownTrials().map((trial) => former.get(JSON.stringify(trial)) || trialRow(trial));
  const kept = new Set(rows);
  for (const row of [...body.rows]) if (!kept.has(row)) row.remove();
  rows.forEach((row, i) => { if (body.rows[i] !== row) body.insertBefore(row, body.rows[i] || null); });
  if (!focused || body.contains(focused) || !rows.length) return;
  const buttons = [...rows[Math.min(place, rows.length - 1)].querySelectorAll("button")];
  buttons.find((button) => button.textContent === name).focus();
}

function trialRow(trial) {
  const row = element("tr");
  row.dataset.text = JSON.stringify(trial);
  const buttons = element("td");
  const decided = Object.entries(trial.decided);
  if (decided.length) {
    const accept = element("button", "Accept");
    accept.title = `Label ${trial.file} as it was decided`;
    accept.onclick = () => act({ do: "accept", file: trial.file });
    buttons.append(accept, " ");
  }
  const relabel = element("button", decided.length ? "Correct" : "Relabel");
  relabel.title = `Give ${trial.file} the labels chosen above; its other tasks keep theirs`;
  relabel.onclick = () => act({ do: "relabel", file: trial.file, labels: chosenLabels() });
  const remove = element("button", "Delete");
  remove.title = `Delete ${trial.file}`;
  remove.onclick = () => confirm(`Delete ${trial.file}?`) && act({ do: "delete", file: trial.file });
  buttons.append(relabel, " ", remove);
  const name = element("td", trial.file);
  name.append(element("div", `${trial.seconds.toFixed(2)} s`, "near"));
  const picture = element("td", undefined, "small");
  picture.append(smallCurve(trial.curve));
  const what = element("td", labelText(trial.labels) || "no label");
  for (const [task, answer] of decided) what.append(element("div", `${task}: ${answerText(answer)}`, "near"));
  for (const kind of trial.kinds) what.append(element("span", kind, "flag"));
  row.append(picture, name, what, buttons);
  return row;
}

function drawUndo(picture) {
  $("undo").hidden = !picture.undo;
  say("undo", picture.undo ? `Undo the change of ${picture.undo}` : "Undo");
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
  drawUndo(picture);
  $("notice-part").hidden = !picture.notices.length;
  const notices = JSON.stringify(picture.notices);
  if ($("notices").dataset.shown === notices) return;
  $("notices").dataset.shown = notices;
  $("notices").replaceChildren(...picture.notices.map((text) => element("li", text)));
}

$("undo").onclick = () => act({ do: "undo" });
$("more").onclick = () => labelRow("", "");
$("labels").onsubmit = (event) => event.preventDefault();
$("filter").onchange = drawTrials;
addEventListener("keydown", (event) => {
  if (["INPUT", "SELECT", "TEXTAREA"].includes(event.target.tagName) || event.ctrlKey || event.metaKey) return;
  const button = document.querySelector(`#choices button[data-key="${event.key}"]`);
  if (button) button.click();
});
$("record").onclick = async () => {
  const on = !(latest && latest.recording);
  const labels = chosenLabels();
  if (!on || !Object.keys(labels).length || await act({ do: "labels", labels })) act({ do: "record", on });
};
addEventListener("resize", () => latest && draw(latest));

// A stream of pictures; the browser opens it again by itself where it breaks.
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
