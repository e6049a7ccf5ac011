// The page of the copy stand: shows what the program says, and sends what is answered. All state is the
// program's, so that a page that was loaded again, or on another tablet, shows the same.

const CHANNELS = ["#d66", "#6b6", "#69d"];
const GREY = "#ccc";
const RETRY_MS = 1000;
// Somewhat longer than the program lets a question for news rest.
const PATIENCE_MS = 8000;

const element = (id) => document.getElementById(id);
let shown = {};

async function follow() {
  let version = -1;
  for (;;) {
    try {
      const answer = await fetch(`state?after=${version}`, { signal: AbortSignal.timeout(PATIENCE_MS) });
      if (!answer.ok) throw new Error(answer.statusText);
      const state = await answer.json();
      element("lost").hidden = true;
      version = state.version;
      show(state);
      if (state.ended) return;
    } catch {
      // The program may have been started anew: whatever it shows then is news.
      version = -1;
      element("lost").hidden = false;
      await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
    }
  }
}

function show(state) {
  const all = state.total && state.done === state.total;
  const still = all ? "All photographs are taken" : state.ended ? "Stopped" : "Waiting";
  element("now").textContent = state.now?.label ?? still;
  if (state.total) {
    element("count").textContent = `${state.done} of ${state.total} photographs`;
    element("progress").max = state.total;
    element("progress").value = state.done;
  }
  const next = (state.next ?? []).map((shot) => shot.label);
  element("next-part").hidden = !next.length;
  list("next", next);
  const again = state.again ?? [];
  element("again-part").hidden = !again.length;
  list("again", again);
  element("waiting").hidden = !state.waiting;
  element("waiting").textContent = state.waiting ?? "";
  showPhotograph(state);
  showQuestion(state.question);
  const coverage = state.coverage;
  element("coverage-part").hidden = !coverage;
  if (coverage) {
    element("coverage").textContent =
      `${coverage.lights} lamps: narrowest ${coverage.narrowest_deg.toFixed(1)}°, ` +
      `gaps ${coverage.gap_deg.toFixed(1)}°: ${coverage.enough ? "covered" : "may fall between the lamps"}`;
  }
  element("stop").hidden = Boolean(state.ended || state.question || !state.now);
  shown = state;
}

function showPhotograph(state) {
  const seen = state.photograph;
  if (!seen) return;
  if (state.pictures !== shown.pictures || !element("photograph").src) {
    for (const [id, file] of [["photograph", "photograph.jpg"], ["clipped", "clipped.png"]]) {
      const image = element(id);
      image.src = `picture/${file}?${state.pictures}`;
      image.hidden = false;
    }
  }
  element("caption").textContent = `${seen.name}: ${seen.label}`;
  element("shares").textContent =
    `clipped, marked red: ${percent(seen.clipped)} · brightest twentieth: ${(100 * seen.bright).toFixed(0)} %`;
  list("findings", state.question?.problem ? [] : seen.findings.map((finding) => finding.what));
  drawHistogram(seen.histogram);
}

function drawHistogram(channels) {
  const most = Math.max(...channels.flat(), 1e-9);
  const lines = channels.map((shares, channel) => {
    const line = document.createElementNS("http://www.w3.org/2000/svg", "polyline");
    const points = shares.map((share, bin) => {
      const x = (256 * (bin + 0.5)) / shares.length;
      return `${x},${80 - 76 * Math.sqrt(share / most)}`;
    });
    line.setAttribute("points", points.join(" "));
    line.setAttribute("fill", "none");
    line.setAttribute("stroke", channels.length > 1 ? CHANNELS[channel] : GREY);
    line.setAttribute("stroke-width", "1.5");
    line.setAttribute("vector-effect", "non-scaling-stroke");
    return line;
  });
  element("histogram").replaceChildren(...lines);
}

function showQuestion(question) {
  const part = element("question");
  part.hidden = !question;
  if (!question || question.number === Number(part.dataset.number)) return;
  part.dataset.number = question.number;
  part.classList.toggle("problem", question.problem);
  element("text").textContent = question.text;
  const buttons = Object.entries(question.choices).map(([choice, words], position) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = words[0].toUpperCase() + words.slice(1);
    button.className = position === 0 ? "first" : choice === "stop" ? "quiet" : "";
    button.addEventListener("click", () => answer(question.number, choice));
    return button;
  });
  element("choices").replaceChildren(...buttons);
}

async function answer(number, choice) {
  const buttons = document.querySelectorAll("#choices button");
  for (const button of buttons) button.disabled = true;
  try {
    await fetch("answer", { method: "POST", body: `${number} ${choice}` });
  } catch {
    element("lost").hidden = false;
  }
  for (const button of buttons) button.disabled = false;
}

function list(id, texts) {
  const items = texts.map((text) => {
    const item = document.createElement("li");
    item.textContent = text;
    return item;
  });
  element(id).replaceChildren(...items);
}

function percent(share) {
  if (share === 0) return "0 %";
  return share < 0.0001 ? "under 0.01 %" : `${(100 * share).toFixed(2)} %`;
}

// A foot pedal is a keyboard with one of these keys.
document.addEventListener("keydown", (event) => {
  if (!["Enter", " ", "PageDown", "b"].includes(event.key) || event.repeat) return;
  if (event.target instanceof HTMLButtonElement && event.key !== "PageDown") return;
  event.preventDefault();
  document.querySelector("#choices button.first")?.click();
});
// The tablet knows at once that it has no network; that the program is out of reach shows with the next question.
addEventListener("offline", () => {
  element("lost").hidden = false;
});
element("stop").addEventListener("click", () => fetch("stop", { method: "POST" }));
follow();
