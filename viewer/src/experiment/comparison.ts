// A trial: the photograph and two candidates, side by side or one at a time at one place.

import { type JsPsychPlugin, ParameterType, type TrialType } from "jspsych";
import type { Answer, Choice, SessionInfo, Trial } from "./api";
import { make, painted } from "./dom";
import type { Pictures } from "./pictures";
import { type Box, place, room, type Size } from "./place";

const INFO = {
  name: "paired-comparison",
  version: "1.0.0",
  parameters: {
    shown: { type: ParameterType.OBJECT, default: undefined },
    session: { type: ParameterType.OBJECT, default: undefined },
    pictures: { type: ParameterType.OBJECT, default: undefined },
  },
  data: { answer: { type: ParameterType.OBJECT } },
} as const;

type Where = "left" | "reference" | "right";
const COLUMN: Record<Where, number> = { left: -1, reference: 0, right: 1 };

const BESIDE = {
  labels: { left: "Left is closer", tie: "No difference", right: "Right is closer" },
  keys: { ArrowLeft: "left", ArrowDown: "tie", ArrowRight: "right" } as Record<string, Choice>,
  hint: ["←", "↓", "→"],
};
const ALTERNATING = {
  labels: { left: "First is closer", tie: "No difference", right: "Second is closer" },
  keys: { "1": "left", "0": "tie", "2": "right" } as Record<string, Choice>,
  hint: ["1", "0", "2"],
};
const VIEWS: Record<string, Where> = { ArrowLeft: "left", ArrowDown: "reference", ArrowRight: "right" };
const VIEW_LABELS: Record<Where, string> = { left: "First", reference: "Photograph", right: "Second" };

/** Ends with the answer, in which `token` names the trial. */
export class PairedComparison implements JsPsychPlugin<typeof INFO> {
  static info = INFO;

  async trial(display: HTMLElement, options: TrialType<typeof INFO>): Promise<{ answer: Answer }> {
    const shown = options.shown as unknown as Trial;
    const session = options.session as unknown as SessionInfo;
    const pictures = options.pictures as unknown as Pictures;
    const images = Object.fromEntries(
      await Promise.all(
        (["left", "reference", "right"] as const).map(
          // A copy, because the same picture may stand at two places.
          async (where) => [where, (await pictures.get(shown[where])).cloneNode() as HTMLImageElement],
        ),
      ),
    ) as Record<Where, HTMLImageElement>;
    await Promise.all(Object.values(images).map((image) => image.decode()));
    const comparison = new Comparison(display, shown, session, images);
    const answer = await comparison.answered();
    comparison.remove();
    pictures.expect(shown.ahead, []);
    return { answer };
  }
}

class Comparison {
  private readonly root = make("div", { class: "comparison" });
  private readonly tooSmall = make("p", { class: "too-small", role: "alert", hidden: true });
  private readonly controls = make("div", { class: "controls waiting" });
  private readonly choices: HTMLButtonElement[];
  private readonly stop = new AbortController();
  private readonly size: Size;
  private readonly seen = new Set<Where>();
  private readonly alternating: boolean;
  private since = 0;
  private ready = false;
  private fits = true;

  constructor(
    display: HTMLElement,
    private readonly shown: Trial,
    private readonly session: SessionInfo,
    private readonly images: Record<Where, HTMLImageElement>,
  ) {
    this.alternating = session.layout === "alternating";
    const style = this.alternating ? ALTERNATING : BESIDE;
    this.size = { width: images.reference.naturalWidth, height: images.reference.naturalHeight };
    for (const [where, image] of Object.entries(images)) {
      image.className = `picture ${where}`;
      image.alt =
        { left: "first candidate", reference: "photograph", right: "second candidate" }[where] ?? "";
      this.root.append(image);
    }
    const offered: Choice[] = session.ties ? ["left", "tie", "right"] : ["left", "right"];
    this.choices = offered.map((choice) => {
      const index = ["left", "tie", "right"].indexOf(choice);
      return make(
        "button",
        { type: "button", "data-choice": choice, disabled: true },
        style.labels[choice],
        make("kbd", {}, style.hint[index] ?? ""),
      );
    });
    const words = shown.practice ? "Practice" : `${shown.number} of ${shown.total}`;
    if (this.alternating) this.controls.append(this.views());
    this.controls.append(
      make("div", { class: "choices" }, ...this.choices),
      make("progress", { max: shown.total, value: shown.number - 1, "aria-label": words }),
      make("span", { class: "count" }, words),
    );
    this.root.append(this.controls, this.tooSmall);
    this.arrange();
    display.replaceChildren(this.root);
    if (this.alternating) this.view("reference");
  }

  /** Show the pictures, and return the answer once it may be and is given. */
  async answered(): Promise<Answer> {
    const signal = this.stop.signal;
    window.addEventListener("resize", () => this.arrange(), { signal });
    await painted();
    this.since = performance.now();
    const style = this.alternating ? ALTERNATING : BESIDE;
    return new Promise((resolve) => {
      const end = (choice: Choice, input: Answer["window"]["input"]) => {
        if (!this.ready || (choice === "tie" && !this.session.ties)) return;
        this.ready = false;
        resolve(this.answer(choice, input));
      };
      for (const button of this.choices) {
        let input: Answer["window"]["input"] = "key";
        button.addEventListener("pointerdown", (event) => {
          input = event.pointerType === "touch" || event.pointerType === "pen" ? event.pointerType : "mouse";
        });
        button.addEventListener("click", () => end(button.dataset.choice as Choice, input));
      }
      window.addEventListener(
        "keydown",
        (event) => {
          if (event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
          const view = VIEWS[event.key];
          if (this.alternating && view !== undefined) this.view(view);
          const choice = style.keys[event.key];
          if (choice !== undefined) end(choice, "key");
        },
        { signal },
      );
      this.allowLater();
    });
  }

  remove(): void {
    this.stop.abort();
    this.root.replaceChildren(); // nothing but the neutral field until the next pictures are there
  }

  private allowLater(): void {
    const left = this.session.minimum_view_s * 1000 - (performance.now() - this.since);
    // Timers may fire a little early, and the server does not take an answer that is too fast.
    window.setTimeout(() => (left > 0 ? this.allowLater() : this.allow()), Math.max(0, left) + 1);
  }

  private allow(): void {
    if (this.alternating && this.seen.size < 3) return;
    if (performance.now() - this.since < this.session.minimum_view_s * 1000) return;
    this.ready = this.fits;
    // Their room was kept for them: nothing moves.
    this.controls.classList.remove("waiting");
    for (const button of this.choices) button.disabled = !this.ready;
  }

  private views(): HTMLElement {
    const buttons = (["left", "reference", "right"] as const).map((where) => {
      const button = make(
        "button",
        { type: "button", "data-view": where, "aria-pressed": "false" },
        VIEW_LABELS[where],
        make("kbd", {}, { left: "←", reference: "↓", right: "→" }[where]),
      );
      button.addEventListener("click", () => this.view(where));
      return button;
    });
    return make("div", { class: "views" }, ...buttons);
  }

  private view(wanted: Where): void {
    this.seen.add(wanted);
    for (const where of ["left", "reference", "right"] as const) {
      this.images[where].style.visibility = where === wanted ? "visible" : "hidden";
      const button = this.root.querySelector(`[data-view=${where}]`);
      button?.setAttribute("aria-pressed", String(where === wanted));
    }
    if (this.since > 0) this.allow();
  }

  private arrange(): void {
    const ratio = window.devicePixelRatio;
    const inner = { width: window.innerWidth, height: window.innerHeight };
    for (const where of ["left", "reference", "right"] as const) {
      const box: Box = place(this.size, this.alternating ? 0 : COLUMN[where], inner, ratio);
      for (const side of ["left", "top", "width", "height"] as const) {
        this.images[where].style[side] = `${box[side]}px`;
      }
    }
    const needed = room(this.size, this.session.layout, ratio);
    this.fits = needed.width <= inner.width && needed.height <= inner.height;
    this.tooSmall.hidden = this.fits;
    this.tooSmall.textContent = `The pictures need a window of ${Math.ceil(needed.width)} × ${Math.ceil(needed.height)}; \
this one has ${inner.width} × ${inner.height}. Please enlarge it, with the key F11 for instance.`;
    this.root.classList.toggle("hidden-pictures", !this.fits);
    if (this.fits && this.since > 0) this.allow();
    else this.ready = false;
    for (const button of this.choices) button.disabled = !this.ready;
  }

  private answer(choice: Choice, input: Answer["window"]["input"]): Answer {
    return {
      token: this.shown.token,
      choice,
      response_s: (performance.now() - this.since) / 1000,
      window: {
        width: window.innerWidth,
        height: window.innerHeight,
        device_pixel_ratio: window.devicePixelRatio,
        full_screen: document.fullscreenElement !== null,
        input,
      },
    };
  }
}
