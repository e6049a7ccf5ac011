// The page of the laboratory: observers, progress, the scale so far, answers, deletion.

import { make } from "./dom";
import { field, form, number, value } from "./form";
import "./experiment.css";
import "./admin.css";

interface SessionState {
  observer: string;
  session: number;
  code: string;
  display: string;
  steps: string[];
  answered: number;
  total: number;
  catches: number;
  caught: number;
  repeats: number;
  repeated: number;
  last_answer_at: string | null;
}

interface Scaled {
  condition: string;
  chosen: number;
  asked: number;
  scale: number | null;
  standard_error: number | null;
}

interface LiveScale {
  answers: number;
  observers: number;
  simulated: number;
  unit: string;
  status: string;
  conditions: Scaled[];
}

const TOKEN = "impasto-laboratory";
const REFRESH_MS = 5_000;
const laboratory = document.getElementById("laboratory")!;

class Laboratory {
  constructor(private readonly token: string) {}

  async ask(method: string, path: string, body?: object): Promise<Response> {
    const headers: Record<string, string> = { Authorization: `Bearer ${this.token}` };
    if (body) headers["Content-Type"] = "application/json";
    const response = await fetch(`/api/admin${path}`, {
      method,
      headers,
      ...(body ? { body: JSON.stringify(body) } : {}),
    });
    if (!response.ok)
      throw new Error(response.status === 401 ? "This token is not valid" : response.statusText);
    return response;
  }

  async save(path: string, name: string): Promise<void> {
    const link = make("a", { download: name });
    link.href = URL.createObjectURL(await (await this.ask("GET", path)).blob());
    link.click();
    URL.revokeObjectURL(link.href);
  }
}

function table(header: string[], rows: (string | Node)[][]): HTMLElement {
  return make(
    "table",
    {},
    make("thead", {}, make("tr", {}, ...header.map((text) => make("th", { scope: "col" }, text)))),
    make("tbody", {}, ...rows.map((row) => make("tr", {}, ...row.map((cell) => make("td", {}, cell))))),
  );
}

const share = (right: number, all: number) => (all === 0 ? "" : `${right} of ${all}`);

function sessionTable(states: SessionState[], forget: (observer: string) => void): HTMLElement {
  return table(
    [
      "Observer",
      "Session",
      "Link",
      "Display",
      "Answers",
      "Catch trials right",
      "Repeats alike",
      "Last answer",
      "",
    ],
    states.map((state) => {
      const remove = make("button", { type: "button", class: "small" }, "Delete");
      remove.addEventListener("click", () => forget(state.observer));
      return [
        state.observer,
        String(state.session),
        make("a", { href: `/#${state.code}`, target: "_blank", rel: "noopener" }, state.code),
        state.display,
        `${state.answered} of ${state.total}`,
        share(state.caught, state.catches),
        share(state.repeated, state.repeats),
        state.last_answer_at ?? "",
        remove,
      ];
    }),
  );
}

function scaleTable(scale: LiveScale): HTMLElement {
  const shown = (value: number | null) => (value === null ? "–" : value.toFixed(2).replace("-", "−"));
  const simulated = scale.simulated > 0 ? `, ${scale.simulated} of them SIMULATED` : "";
  return make(
    "div",
    {},
    make("p", {}, `${scale.answers} answers of ${scale.observers} observers${simulated}; ${scale.status}`),
    table(
      ["Condition", "Chosen", `Scale, ${scale.unit}`, "Standard error"],
      scale.conditions.map((entry) => [
        entry.condition,
        share(entry.chosen, entry.asked),
        shown(entry.scale),
        shown(entry.standard_error),
      ]),
    ),
  );
}

async function show(lab: Laboratory): Promise<void> {
  const described = await (await lab.ask("GET", "/experiment")).json();
  const sessions = make("div");
  const scale = make("div");
  const problem = make("p", { role: "alert", hidden: true });
  const say = (error: unknown) => {
    problem.hidden = error === null;
    problem.textContent = error instanceof Error ? error.message : "";
  };
  const refresh = async () => {
    try {
      const states: SessionState[] = await (await lab.ask("GET", "/sessions")).json();
      const found: LiveScale = await (await lab.ask("GET", "/scale")).json();
      sessions.replaceChildren(sessionTable(states, forget));
      scale.replaceChildren(scaleTable(found));
      say(null);
    } catch (error) {
      say(error);
    }
  };
  const forget = async (observer: string) => {
    if (!confirm(`Delete all sessions and answers of ${observer}? This cannot be undone.`)) return;
    await lab.ask("DELETE", `/observers/${encodeURIComponent(observer)}`).catch(say);
    await refresh();
  };
  const invite = make(
    "form",
    { class: "invite" },
    field("New observers", { name: "observers", type: "number", min: 1, max: 50, value: 1, required: true }),
    field("Sessions each", { name: "sessions", type: "number", min: 1, max: 4, value: 1, required: true }),
    make("button", { type: "submit" }, "Invite"),
  );
  invite.addEventListener("submit", async (event) => {
    event.preventDefault();
    const body = { observers: number(invite, "observers"), sessions: number(invite, "sessions") };
    await lab.ask("POST", "/observers", body).catch(say);
    await refresh();
  });
  const save = (name: string) => {
    const button = make("button", { type: "button" }, name);
    button.addEventListener("click", () => lab.save(`/${name}`, name).catch(say));
    return button;
  };
  laboratory.replaceChildren(
    make("h1", {}, described.texts.title),
    problem,
    make("section", {}, make("h2", {}, "Observers"), sessions, invite),
    make("section", {}, make("h2", {}, "Scale so far, all samples and angles pooled"), scale),
    make(
      "section",
      {},
      make("h2", {}, "Answers"),
      make("p", { class: "saves" }, save("answers.csv"), save("answers.json")),
    ),
  );
  for (;;) {
    await refresh();
    await new Promise((resolve) => setTimeout(resolve, REFRESH_MS));
  }
}

async function run(): Promise<void> {
  let token = location.hash.slice(1) || sessionStorage.getItem(TOKEN) || "";
  history.replaceState(null, "", location.pathname); // not for the next person's eyes
  let message = "Please type the token that the server printed.";
  for (;;) {
    const lab = new Laboratory(token);
    try {
      if (token !== "") {
        await lab.ask("GET", "/experiment");
        sessionStorage.setItem(TOKEN, token);
        return await show(lab);
      }
    } catch (error) {
      message = error instanceof Error ? `${error.message}.` : message;
    }
    const filled = await form(laboratory, "Laboratory", [
      make("p", {}, message),
      field("Token", { name: "token", type: "password", required: true, autocomplete: "off" }),
    ]);
    token = value(filled, "token");
  }
}

run();
