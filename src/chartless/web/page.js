// The page: what the server knows is drawn, what the user does is asked of the server.

import { setUpLive } from "./live.js";

const find = (id) => document.getElementById(id);
const POLL = 300; // milliseconds between two looks at work that goes on
const UNTIL_SAVED = 60_000; // milliseconds for which a browser may still read a download
const MOST_REFUSED = 5; // files that were refused
const MARKS = { good: "✓", care: "!", distrust: "✕" };
const GRADES = { good: "good", care: "usable with care", distrust: "do not trust" };

let state = { files: [], cameras: [] };
let shown = location.hash.slice(1); // id of the result in sight, or ids of those compared
let drawn = ""; // the result whose report is in sight
let awaited = ""; // the result that was asked for last, until it is there
let timer = 0;
let sending = Promise.resolve(); // of files, one after the other
let isSending = false;
const compared = new Set(shown.includes(",") ? shown.split(",") : []);

/* Requests. */

async function ask(path, settings = {}) {
  const { json, ...rest } = settings;
  const answer = await fetch(`api/${path}`, {
    ...rest,
    headers: { "X-Chartless": "1" },
    ...(json === undefined ? {} : { body: JSON.stringify(json) }),
  }).catch(() => {
    throw new Error("chartless serve does not answer: start it again in its terminal.");
  });
  if (!answer.ok) throw new Error(await reason(answer));
  return answer;
}

async function reason(answer) {
  const text = await answer.text();
  try {
    return JSON.parse(text).error;
  } catch {
    return text || `the server answered ${answer.status}`;
  }
}

function showMessage(text) {
  find("message").hidden = !text;
  find("message").textContent = text;
}

function attempt(action) {
  return async (...given) => {
    try {
      await action(...given);
    } catch (error) {
      showMessage(error.message);
    }
  };
}

/* What there is. */

async function refresh() {
  clearTimeout(timer);
  state = await (await ask("state")).json();
  draw();
  pointToRemedy();
  if (state.cameras.some((each) => each.state === "running")) {
    timer = setTimeout(attempt(refresh), POLL);
  }
}

function draw() {
  replace(find("uploads"), state.files.map(uploadRow));
  replace(find("cameras"), state.cameras.map(cameraRow));
  find("none").hidden = state.cameras.length > 0;
  find("clear").hidden = state.files.length < 2;
  find("calibrate").disabled = isSending || !state.files.some((each) => each.role === "frame");
  for (const file of state.files) find(`use-${file.id}`).value = file.role;
  for (const id of compared) {
    if (!state.cameras.some((each) => each.id === id)) compared.delete(id);
  }
  find("compare").hidden = state.cameras.filter((each) => each.state === "done").length < 2;
  find("compare").disabled = compared.size < 2;
  find("compare").textContent = compared.size < 2 ? "Compare (tick two)" : "Compare";
  drawSheet();
}

// Rows that have not changed stay where they are, so that focus and open menus do.
function replace(list, rows) {
  const old = new Map([...list.children].map((each) => [each.dataset.key, each]));
  const wanted = rows.map(({ key, make }) => old.get(key) ?? keyed(make(), key));
  for (const row of old.values()) {
    if (!wanted.includes(row)) row.remove();
  }
  for (const [place, row] of wanted.entries()) {
    if (list.children[place] !== row) list.insertBefore(row, list.children[place] ?? null);
  }
}

function keyed(element, key) {
  element.dataset.key = key;
  return element;
}

function make(name, settings = {}, ...children) {
  const element = Object.assign(document.createElement(name), settings);
  element.append(...children);
  return element;
}

function removeButton(name, action) {
  const button = make("button", { type: "button", textContent: "×", title: `Remove ${name}` });
  button.setAttribute("aria-label", `Remove ${name}`);
  button.addEventListener("click", attempt(async () => {
    const row = button.closest("li");
    const beside = row.nextElementSibling ?? row.previousElementSibling;
    await action();
    (beside?.querySelector("button:last-child") ?? find("files")).focus();
  }));
  return button;
}

function uploadRow(file) {
  return {
    key: file.id,
    make() {
      const roles = { frame: "frame", dark: "lens covered", unused: "leave out" };
      const select = make("select", { id: `use-${file.id}`, ariaLabel: `Use of ${file.name}` });
      select.append(...Object.entries(roles).map(([value, text]) => make("option", { value }, text)));
      select.addEventListener("change", attempt(async () => {
        await ask(`files/${file.id}`, { method: "PATCH", json: { role: select.value } });
        await refresh();
      }));
      const remove = removeButton(file.name, async () => {
        await ask(`files/${file.id}`, { method: "DELETE" });
        await refresh();
      });
      const size = `${(file.size / 1e6).toFixed(1)} MB`;
      return make("li", {}, make("span", { title: size }, file.name), select, remove);
    },
  };
}

function cameraRow(camera) {
  const grade = camera.result?.grade;
  const current = camera.id === shown;
  return {
    key: JSON.stringify([camera.id, camera.state, current]),
    make() {
      const mark = grade ? MARKS[grade] : camera.state === "failed" ? "✕" : "…";
      const words = GRADES[grade] ?? camera.state;
      const sign = make("span", { className: `mark ${grade ?? "distrust"}`, ariaHidden: "true" }, mark);
      if (camera.state === "running") sign.className = "mark";
      const open = make("button", { type: "button", className: "open", title: words }, camera.title);
      open.setAttribute("aria-label", `${camera.title}: ${words}`);
      open.addEventListener("click", () => show(camera.id));
      const remove = removeButton(camera.title, async () => {
        await ask(`cameras/${camera.id}`, { method: "DELETE" });
        await refresh();
      });
      const row = make("li", {}, sign, open);
      if (current) row.setAttribute("aria-current", "true");
      if (camera.state === "done") {
        const checked = compared.has(camera.id);
        const tick = make("input", { type: "checkbox", checked, title: "Compare" });
        tick.setAttribute("aria-label", `Compare ${camera.title}`);
        tick.addEventListener("change", () => {
          if (tick.checked) compared.add(camera.id);
          else compared.delete(camera.id);
          draw();
        });
        row.append(tick);
      }
      row.append(remove);
      return row;
    },
  };
}

/* The sheet: a result, a comparison, or how to begin. */

function show(id) {
  if (id !== shown) history.pushState(null, "", `#${id}`);
  turn(id);
}

function turn(id) {
  shown = id;
  showMessage("");
  find("lost").textContent = "";
  live.leave();
  draw();
  choose();
  if (!find("shown").hidden) find("shown-title").focus();
  pointToRemedy();
}

// The form says how the result in sight was made.
function choose() {
  const options = state.cameras.find((each) => each.id === shown)?.options;
  if (!options) return;
  for (const field of find("options").elements) {
    if (field.type === "checkbox") field.checked = field.name in options;
    else if (field.name) field.value = options[field.name] ?? "";
  }
}

// Who waited for a result that failed goes on at the option that the reason names.
function pointToRemedy() {
  const camera = state.cameras.find((each) => each.id === awaited);
  if (camera?.state === "running") return;
  awaited = "";
  const isWaiting = [document.body, find("shown-title")].includes(document.activeElement);
  if (camera?.id === shown && isWaiting) focusNamed(camera.error);
}

function focusNamed(text) {
  const names = [...text.matchAll(/--([a-z]+(?:-[a-z]+)*)/g)].map(([, name]) => name.replace("-", "_"));
  const field = names.map((name) => find("options").elements[name]).find(Boolean);
  if (find("more").contains(field ?? null)) find("more").open = true;
  field?.focus();
}

function drawSheet() {
  const chosen = shown.split(",").map((id) => state.cameras.find((each) => each.id === id));
  const [camera, ...others] = chosen.filter(Boolean);
  const comparing = others.length > 0;
  find("live").hidden = !live.running;
  find("shown").hidden = live.running || !camera;
  find("welcome").hidden = live.running || !find("shown").hidden;
  if (find("shown").hidden) return;
  find("shown-title").textContent = comparing ? "Comparison" : camera.title;
  const is = comparing ? "compared" : camera.state;
  find("running").hidden = is !== "running";
  find("failed").hidden = is !== "failed";
  find("take").hidden = is !== "done";
  for (const id of ["verdict-first", "report"]) {
    find(id).hidden = is === "running" || is === "failed";
  }
  if (is === "running") {
    find("stage").textContent = `${camera.stage[0].toUpperCase()}${camera.stage.slice(1)}…`;
    find("bar").value = camera.share;
  } else if (is === "failed") {
    find("reason").textContent = camera.error;
    find("hint").hidden = !/--[a-z]/.test(camera.error);
    if (!find("hint").hidden) find("more").open = true;
  } else if (is === "done") {
    find("json").href = `api/cameras/${camera.id}/camera.json`;
    find("keep").href = `api/cameras/${camera.id}/report.html?keep`;
    fill(`cameras/${camera.id}/report.html`);
  } else {
    fill(`comparison?cameras=${[camera, ...others].map((each) => each.id).join(",")}`);
  }
}

const fill = attempt(async (path) => {
  if (drawn === path) return;
  drawn = path;
  find("verdict-first").replaceChildren();
  find("report").replaceChildren();
  const text = await ask(path).then((answer) => answer.text(), (error) => {
    if (drawn === path) drawn = "";
    throw error;
  });
  if (drawn !== path) return; // something else was asked for meanwhile
  const page = new DOMParser().parseFromString(text, "text/html");
  const parts = [...(page.querySelector("main") ?? page.body).children];
  const first = parts[0].classList.contains("verdict") ? 1 : 0;
  find("verdict-first").replaceChildren(...parts.slice(0, first));
  find("report").replaceChildren(...parts.slice(first));
});

/* What the user does. */

function upload(list) {
  const files = [...list]; // which is emptied when the event is over
  sending = sending.then(() => send(files));
}

const send = attempt(async (files) => {
  showMessage("");
  isSending = true;
  draw();
  const refused = [];
  let camera = "";
  for (const [place, file] of files.entries()) {
    find("status").textContent = `Taking ${file.name} (${place + 1} of ${files.length})…`;
    try {
      await file.slice(0, 1).arrayBuffer().catch(() => {
        throw new Error(`${file.name}: cannot be read: give files, no folders`);
      });
      const path = `files?name=${encodeURIComponent(file.name)}`;
      const added = await (await ask(path, { method: "PUT", body: file })).json();
      if (added.is_camera) camera = added.id;
    } catch (error) {
      refused.push(error.message);
    }
  }
  find("status").textContent = "";
  isSending = false;
  await refresh();
  if (camera) show(camera);
  const more = refused.splice(MOST_REFUSED).length;
  showMessage([...refused, ...(more ? [`And ${more} more.`] : [])].join("\n"));
});

const calibrate = attempt(async () => {
  showMessage("");
  find("calibrate").disabled = true; // a second click would begin a second one
  const options = Object.fromEntries(new FormData(find("options")));
  try {
    const { id } = await (await ask("cameras", { method: "POST", json: options })).json();
    await refresh();
    awaited = id;
    show(id);
  } catch (error) {
    focusNamed(error.message);
    throw error;
  } finally {
    draw();
  }
});

find("files").addEventListener("change", () => {
  upload(find("files").files);
  find("files").value = "";
});
addEventListener("dragover", (event) => {
  event.preventDefault();
  find("drop").classList.add("over");
});
addEventListener("dragleave", (event) => {
  if (!event.relatedTarget) find("drop").classList.remove("over");
});
addEventListener("drop", (event) => {
  event.preventDefault();
  find("drop").classList.remove("over");
  if (event.dataTransfer.files.length) upload(event.dataTransfer.files);
});
find("options").addEventListener("submit", (event) => {
  event.preventDefault();
  calibrate();
});
// Once there is a result, another method or model is tried at once.
for (const name of ["method", "model"]) {
  find("options").elements[name].addEventListener("change", () => {
    if (state.cameras.length && !find("calibrate").disabled) calibrate();
  });
}
find("clear").addEventListener("click", attempt(async () => {
  await ask("files", { method: "DELETE" });
  await refresh();
}));
find("stop").addEventListener("click", attempt(async () => {
  await ask(`cameras/${shown}`, { method: "DELETE" });
  await refresh();
}));
find("compare").addEventListener("click", () => show([...compared].join(",")));
addEventListener("popstate", () => turn(location.hash.slice(1)));
find("export").addEventListener("click", attempt(async () => {
  find("lost").textContent = "";
  const answer = await ask(`cameras/${shown}/export/${find("format").value}`);
  const [, name] = answer.headers.get("Content-Disposition").match(/filename="([^"]+)"/);
  const lost = decodeURIComponent(answer.headers.get("X-Lost"));
  const address = URL.createObjectURL(await answer.blob());
  make("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), UNTIL_SAVED);
  find("lost").textContent = lost ? `${name} does not hold everything: ${lost}.` : "";
}));

const live = setUpLive({ ask, showMessage, attempt, redraw: draw, saved: async (id) => {
  await refresh();
  show(id);
} });

attempt(async () => {
  await (await ask("session", { method: "POST" })).json();
  await refresh();
  choose();
})();
