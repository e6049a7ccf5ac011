// What precedes the trials: consent, viewing conditions, instructions, full screen, the neutral field.

import type { SessionInfo, Viewing } from "./api";
import { make, paragraphs } from "./dom";
import { field, form, number, value } from "./form";

/** Ask for the code of a session. */
export async function askForCode(display: HTMLElement, message: string): Promise<string> {
  const filled = await form(display, "Welcome", [
    make("p", {}, message),
    field("Code", { name: "code", required: true, autocomplete: "off", spellcheck: "false", maxlength: 40 }),
  ]);
  display.replaceChildren();
  return value(filled, "code");
}

/** Ask for consent. */
export async function askForConsent(display: HTMLElement, session: SessionInfo): Promise<{ agreed: true }> {
  const box = make("input", { type: "checkbox", name: "agreed", required: true });
  await form(display, session.title, [
    ...paragraphs(session.consent),
    make("label", { class: "agree" }, box, "I have read this, and agree to take part."),
  ]);
  return { agreed: true };
}

/** Ask for the viewing conditions, or have those that the laboratory states confirmed. */
export async function askForViewing(display: HTMLElement, session: SessionInfo): Promise<object> {
  const known = session.viewing;
  const filled = await form(display, "Viewing conditions", [
    make("p", {}, "Please complete or confirm what is known about the display."),
    field("Display", { name: "display", value: known.display, maxlength: 100, required: true }),
    field("Calibrated to", { name: "profile", value: known.profile, maxlength: 100 }),
    field("Luminance of white, cd/m²", {
      name: "luminance_cd_m2",
      type: "number",
      min: 1,
      max: 10000,
      step: "any",
      value: known.luminance_cd_m2 ?? "",
    }),
    field("Distance from the eyes to the display, mm", {
      name: "distance_mm",
      type: "number",
      min: 100,
      max: 10000,
      step: "any",
      value: known.distance_mm ?? "",
    }),
    field("Surround and light of the room", { name: "surround", value: known.surround, maxlength: 200 }),
  ]);
  const stated: Viewing = {
    display: value(filled, "display"),
    profile: value(filled, "profile"),
    luminance_cd_m2: number(filled, "luminance_cd_m2"),
    distance_mm: number(filled, "distance_mm"),
    surround: value(filled, "surround"),
  };
  session.viewing = stated;
  const gamut = (["rec2020", "p3", "srgb"] as const).find(
    (name) => matchMedia(`(color-gamut: ${name})`).matches,
  );
  return {
    ...stated,
    screen_width: screen.width,
    screen_height: screen.height,
    device_pixel_ratio: window.devicePixelRatio,
    colour_depth: screen.colorDepth,
    colour_gamut: gamut ?? "",
  };
}

/** Show the instructions; the window fills the screen afterwards, where the browser allows it. */
export async function instruct(display: HTMLElement, session: SessionInfo): Promise<object> {
  const again = session.answered > 0;
  const keys =
    session.layout === "beside"
      ? ["← ", "the left one", " → ", "the right one"]
      : ["1 ", "the first one", " 2 ", "the second one"];
  const tie = session.ties ? [session.layout === "beside" ? " ↓ " : " 0 ", "no difference"] : [];
  await form(
    display,
    again ? "Welcome back" : session.title,
    [
      ...(again
        ? [
            make(
              "p",
              {},
              `${session.answered} of ${session.total} answers are stored. The session goes on with the next one.`,
            ),
          ]
        : []),
      ...paragraphs(session.instructions),
      make(
        "p",
        {},
        "Click a button, or press a key:",
        ...[...keys, ...tie].map((text, index) => (index % 2 ? text : make("kbd", {}, text.trim()))),
      ),
      ...(session.adaptation_s > 0
        ? [
            make(
              "p",
              {},
              `First you see a grey field for ${Math.round(session.adaptation_s)} seconds, so that your eyes get used to it. The screen will be filled.`,
            ),
          ]
        : []),
    ],
    "Start",
  );
  await document.documentElement.requestFullscreen?.().catch(() => undefined);
  return {};
}

/** Show the neutral field. */
export async function adapt(display: HTMLElement, seconds: number): Promise<{ seconds: number }> {
  const started = performance.now();
  const left = make("p", { class: "adaptation", role: "timer" });
  display.replaceChildren(left);
  for (;;) {
    const rest = seconds - (performance.now() - started) / 1000;
    if (rest <= 0) return { seconds: (performance.now() - started) / 1000 };
    left.textContent = String(Math.ceil(rest));
    await new Promise((resolve) => setTimeout(resolve, Math.min(250, rest * 1000 + 1)));
  }
}

/** Offer a pause. */
export async function pause(display: HTMLElement, done: number, total: number): Promise<object> {
  await form(
    display,
    "Time for a pause",
    [
      make("p", {}, `${done} of ${total} are done. Rest your eyes for as long as you like.`),
      make("p", {}, "You may also close the page, and go on later with the same code."),
    ],
    "Go on",
  );
  return {};
}

/** Say thanks. */
export function thank(display: HTMLElement): void {
  display.replaceChildren(
    make(
      "div",
      { class: "card", tabindex: -1, id: "thanks" },
      make("h1", {}, "Thank you"),
      make("p", {}, "All your answers are stored. You may close this page."),
    ),
  );
  document.getElementById("thanks")?.focus();
}
