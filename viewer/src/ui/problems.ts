/** What goes wrong, said over the picture: each message until it is dismissed. */

import type { StoreProblem } from "../store/errors";
import { h } from "./dom";
import type { Messages } from "./i18n";

const MOST = 3;

export class Problems {
  readonly element = h("div", { class: "messages", role: "log", "aria-live": "polite" });

  constructor(readonly messages: Messages) {}

  words(problem: StoreProblem): string {
    return this.messages.problems[problem.kind](problem.where, problem.detail);
  }

  /** Says a text, once; for good, or for some time. */
  say(text: string, milliseconds = 0): void {
    if ([...this.element.children].some((child) => child.firstChild?.textContent === text)) return;
    const box = h("div", { class: "problem" }, h("div", {}, text));
    box.append(h("button", { type: "button", onclick: () => box.remove() }, this.messages.dismiss));
    while (this.element.children.length >= MOST) this.element.firstChild!.remove();
    this.element.append(box);
    if (milliseconds) setTimeout(() => box.remove(), milliseconds);
  }

  clear(): void {
    this.element.replaceChildren();
  }

  /** Returns what stands in the picture's place where there can be none. */
  fatal(text: string, again?: () => void): HTMLElement {
    const box = h("div", { class: "fatal" }, h("p", { role: "alert" }, text));
    if (again) box.append(h("button", { type: "button", onclick: again }, this.messages.again));
    return box;
  }
}
