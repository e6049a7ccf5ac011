/** The list of annotations, and the form for a new one. */

import type { Annotation, Annotations } from "./annotations";
import { download, h } from "./dom";
import type { Messages } from "./i18n";

export interface NotesActions {
  hash(): string;
  show(hash: string): void;
  change(): void;
}

export class NotesPanel {
  readonly element: HTMLElement;
  readonly #list = h("ul", { class: "notes" });
  readonly #form = h("div", { hidden: true });

  constructor(
    readonly messages: Messages,
    readonly annotations: Annotations,
    readonly actions: NotesActions,
  ) {
    const m = messages;
    const file = h("input", { type: "file", accept: ".json,application/json", hidden: true });
    file.addEventListener("change", () => void this.#import(file));
    this.element = h(
      "fieldset",
      {},
      h("legend", {}, m.annotations),
      this.#form,
      this.#list,
      h(
        "div",
        { class: "buttons" },
        h("button", { type: "button", onclick: () => this.#export() }, m.exportAnnotations),
        h("button", { type: "button", onclick: () => file.click() }, m.importAnnotations),
        file,
      ),
    );
    this.#refresh();
  }

  /** Asks for the text of a note at a pixel. */
  write(x: number, y: number): void {
    const m = this.messages;
    const text = h("textarea");
    const save = () => {
      if (text.value.trim())
        this.annotations.add({ x, y, text: text.value.trim(), state: this.actions.hash() });
      this.#form.hidden = true;
      this.#refresh();
    };
    this.#form.replaceChildren(
      h("label", {}, h("span", {}, `${m.annotationText} · ${m.pixel(x, y)}`), text),
      h(
        "div",
        { class: "buttons" },
        h("button", { type: "button", onclick: save }, m.save),
        h("button", { type: "button", onclick: () => (this.#form.hidden = true) }, m.cancel),
      ),
    );
    this.#form.hidden = false;
    text.focus();
  }

  /** Shows the view and the light of a note. */
  open(id: string): void {
    const note = this.annotations.list.find((each) => each.id === id);
    if (note) this.actions.show(note.state);
  }

  #refresh(): void {
    this.#list.replaceChildren(...this.annotations.list.map((note, i) => this.#item(note, i)));
    this.actions.change();
  }

  #item(note: Annotation, index: number): HTMLElement {
    const remove = () => {
      this.annotations.remove(note.id);
      this.#refresh();
    };
    return h(
      "li",
      {},
      h("button", { type: "button", onclick: () => this.open(note.id) }, `${index + 1} · ${note.text}`),
      h(
        "button",
        { type: "button", "aria-label": `${this.messages.remove} ${index + 1}`, onclick: remove },
        "✕",
      ),
    );
  }

  #export(): void {
    download(new Blob([this.annotations.toJson()], { type: "application/json" }), "annotations.json");
  }

  async #import(file: HTMLInputElement): Promise<void> {
    const chosen = file.files?.[0];
    if (chosen && !this.annotations.fromJson(await chosen.text())) {
      this.#form.replaceChildren(this.messages.noAnnotationFile);
      this.#form.hidden = false;
    }
    file.value = "";
    this.#refresh();
  }
}
