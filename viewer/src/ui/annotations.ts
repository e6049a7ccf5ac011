/** Notes at places of the painting, each with the view and light it was made in; kept in this browser. */

export interface Annotation {
  readonly id: string;
  readonly x: number;
  readonly y: number;
  readonly text: string;
  /** The state as an address has it. */
  readonly state: string;
}

/** Kept per store. */
export class Annotations {
  readonly #key: string;
  list: readonly Annotation[];

  constructor(readonly source: string) {
    this.#key = `impasto-annotations ${source}`;
    this.list = this.#load();
  }

  add(annotation: Omit<Annotation, "id">): Annotation {
    const added = { ...annotation, id: crypto.randomUUID?.() ?? String(Date.now()) };
    this.#save([...this.list, added]);
    return added;
  }

  remove(id: string): void {
    this.#save(this.list.filter((each) => each.id !== id));
  }

  /** Returns the notes as a W3C annotation page. */
  toJson(): string {
    const items = this.list.map(({ id, x, y, text, state }) => ({
      id: `urn:uuid:${id}`,
      type: "Annotation",
      body: { type: "TextualBody", value: text, format: "text/plain" },
      target: { source: this.source, selector: { type: "PointSelector", x, y }, state },
    }));
    const page = { "@context": "http://www.w3.org/ns/anno.jsonld", type: "AnnotationPage", items };
    return JSON.stringify(page, null, 2);
  }

  /** Adds the notes of a file that `toJson` made; returns whether it was one. */
  fromJson(text: string): boolean {
    try {
      const { items } = JSON.parse(text) as { items: ReturnType<typeof JSON.parse>[] };
      const read = items.map(({ id, body, target }): Annotation => {
        const { x, y } = target.selector;
        if (!Number.isFinite(x) || !Number.isFinite(y)) throw new Error("no place");
        return {
          id: String(id).replace("urn:uuid:", ""),
          x,
          y,
          text: String(body.value),
          state: String(target.state),
        };
      });
      const known = new Set(read.map((each) => each.id));
      this.#save([...this.list.filter((each) => !known.has(each.id)), ...read]);
      return true;
    } catch {
      return false;
    }
  }

  #load(): Annotation[] {
    try {
      return JSON.parse(localStorage.getItem(this.#key) ?? "[]") as Annotation[];
    } catch {
      return []; // storage may be forbidden
    }
  }

  #save(list: readonly Annotation[]): void {
    this.list = list;
    try {
      localStorage.setItem(this.#key, JSON.stringify(list));
    } catch {
      // They last as long as the page then, and can still be exported.
    }
  }
}
