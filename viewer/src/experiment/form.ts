// Cards with a form to read and to fill in.

import { make } from "./dom";

/** Show a card with a form, and return its form when it is sent in; the first field or the button has focus. */
export function form(
  display: HTMLElement,
  title: string,
  content: readonly (Node | string)[],
  button = "Continue",
): Promise<HTMLFormElement> {
  const send = make("button", { type: "submit" }, button);
  const body = make("form", { class: "card" }, make("h1", {}, title), ...content, make("footer", {}, send));
  display.replaceChildren(body);
  (body.querySelector<HTMLElement>("input, select") ?? send).focus();
  return new Promise((resolve) =>
    body.addEventListener("submit", (event) => {
      event.preventDefault();
      resolve(body);
    }),
  );
}

/** Return a labelled field of a form. */
export function field(label: string, attributes: Record<string, string | number | boolean>): HTMLElement {
  return make("label", { class: "field" }, make("span", {}, label), make("input", attributes));
}

/** Return a labelled choice of a form. */
export function choice(label: string, name: string, options: readonly [string, string][]): HTMLElement {
  const all = [["", "Please choose"] as const, ...options];
  const items = all.map(([value, text]) => make("option", { value }, text));
  return make(
    "label",
    { class: "field" },
    make("span", {}, label),
    make("select", { name, required: true }, ...items),
  );
}

/** Return what was filled in. */
export function value(form: HTMLFormElement, name: string): string {
  const found = new FormData(form).get(name);
  return typeof found === "string" ? found.trim() : "";
}

/** Return a number that was filled in, null where none was. */
export function number(form: HTMLFormElement, name: string): number | null {
  const text = value(form, name);
  return text === "" ? null : Number(text);
}
