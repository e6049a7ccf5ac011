import { afterEach, describe, expect, it, vi } from "vitest";
import { gapPx } from "../src/experiment/acuity";
import { type Answer, persistently, Refused, Session } from "../src/experiment/api";
import { dotColour, inverse } from "../src/experiment/colour-vision";
import { codeOf, gammaOf } from "../src/experiment/display-check";
import { place, room } from "../src/experiment/place";

class Kept implements Storage {
  private readonly items = new Map<string, string>();
  get length() {
    return this.items.size;
  }
  clear() {
    this.items.clear();
  }
  getItem(key: string) {
    return this.items.get(key) ?? null;
  }
  key(index: number) {
    return [...this.items.keys()][index] ?? null;
  }
  removeItem(key: string) {
    this.items.delete(key);
  }
  setItem(key: string, value: string) {
    this.items.set(key, value);
  }
}

const ANSWER: Answer = {
  token: "t1",
  choice: "left",
  response_s: 1.5,
  window: { width: 1280, height: 800, device_pixel_ratio: 1, full_screen: true, input: "key" },
};
const ok = (body: object) => new Response(JSON.stringify(body));

afterEach(() => vi.unstubAllGlobals());

describe("requests", () => {
  it("are repeated until the server answers", async () => {
    const replies = [
      () => Promise.reject(new TypeError("no connection")),
      () => Promise.resolve(new Response("", { status: 503 })),
      () => Promise.resolve(new Response("", { status: 429 })),
      () => Promise.resolve(ok({ done: true })),
    ];
    const waits: number[] = [];
    const said: boolean[] = [];
    const response = await persistently(
      () => replies.shift()!(),
      (away) => said.push(away),
      async (ms) => void waits.push(ms),
    );
    expect(await response.json()).toEqual({ done: true });
    expect(waits).toEqual([500, 1000, 2000]);
    expect(said).toEqual([true, true, true, false]);
  });

  it("are not repeated when the server refuses", async () => {
    const request = vi.fn(() =>
      Promise.resolve(new Response(JSON.stringify({ detail: "no" }), { status: 409 })),
    );
    const refused = await persistently(request, () => undefined).catch((error: unknown) => error);
    expect(refused).toBeInstanceOf(Refused);
    expect((refused as Refused).message).toBe("no");
    expect(request).toHaveBeenCalledOnce();
  });
});

describe("an answer", () => {
  it("is kept until it is acknowledged", async () => {
    const kept = new Kept();
    let acknowledge = (_: Response) => {};
    const pending = new Promise<Response>((resolve) => {
      acknowledge = resolve;
    });
    vi.stubGlobal("fetch", () => pending);
    const session = new Session("CODE", () => undefined, kept);
    const following = session.answer(ANSWER);
    expect(kept.length).toBe(1);
    acknowledge(ok({ trial: { token: "t2" } }));
    expect(await following).toEqual({ token: "t2" });
    expect(kept.length).toBe(0);
  });

  it("that was not acknowledged is sent when the page is opened again", async () => {
    const kept = new Kept();
    vi.stubGlobal("fetch", () => new Promise(() => undefined)); // the browser is closed before an answer comes
    void new Session("CODE", () => undefined, kept).answer(ANSWER);
    const sent: [string, unknown][] = [];
    vi.stubGlobal("fetch", async (path: string, options: RequestInit) => {
      sent.push([path, JSON.parse(String(options.body))]);
      return ok({ trial: { token: "t2" } });
    });
    const next = await new Session("CODE", () => undefined, kept).next();
    expect(sent).toEqual([["/api/session/answers", ANSWER]]);
    expect(next).toEqual({ token: "t2" });
    expect(kept.length).toBe(0);
  });

  it("of another session is not sent", async () => {
    const kept = new Kept();
    vi.stubGlobal("fetch", () => new Promise(() => undefined));
    void new Session("CODE", () => undefined, kept).answer(ANSWER);
    const paths: string[] = [];
    vi.stubGlobal("fetch", async (path: string) => {
      paths.push(path);
      return ok({ trial: null });
    });
    await new Session("OTHER", () => undefined, kept).next();
    expect(paths).toEqual(["/api/session/next"]);
  });
});

describe("pictures", () => {
  const size = { width: 401, height: 300 };
  it.each([1, 1.25, 1.5, 2])("stand on whole pixels of a display with ratio %f", (ratio) => {
    for (const window of [
      { width: 1280, height: 800 },
      { width: 2560, height: 1440 },
    ]) {
      const boxes = [-1, 0, 1].map((column) => place(size, column, window, ratio));
      for (const box of boxes) {
        expect(Number.isInteger(Math.round(box.left * ratio * 1e6) / 1e6)).toBe(true);
        expect(Number.isInteger(Math.round(box.top * ratio * 1e6) / 1e6)).toBe(true);
        expect([box.width * ratio, box.height * ratio]).toEqual([401, 300]);
      }
      const [left, middle, right] = boxes as [(typeof boxes)[0], (typeof boxes)[0], (typeof boxes)[0]];
      expect(Math.abs(middle.left + middle.width / 2 - window.width / 2) * ratio).toBeLessThan(0.5 + 1e-9);
      expect(Math.abs(middle.top + middle.height / 2 - window.height / 2) * ratio).toBeLessThan(0.5 + 1e-9);
      expect(middle.left - left.left).toBeCloseTo(right.left - middle.left, 9);
    }
  });

  it("of 400 pixels fit a display of 1280 x 800", () => {
    const size = { width: 400, height: 400 };
    expect(room(size, "beside", 1)).toEqual({ width: 1280, height: 700 });
    expect(room(size, "alternating", 1)).toEqual({ width: 820, height: 780 });
  });
});

describe("checks", () => {
  it("read gamma from the code that matches lines of black and white", () => {
    // 186 is the code of half the light on a display of gamma 2.2.
    expect(Math.round(codeOf(2.2))).toBe(186);
    expect(gammaOf(codeOf(1.8))).toBeCloseTo(1.8, 9);
  });

  it("draw plates that differ in one kind of cone", () => {
    const decode = (code: number) => {
      const v = code / 255;
      return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
    };
    const lms = [
      [0.31399, 0.63951, 0.0465],
      [0.15537, 0.75789, 0.08674],
      [0.01775, 0.10944, 0.87281],
    ] as [number, number, number][];
    const excitation = (axis: "protan" | "deutan" | "tritan", side: number) => {
      const rgb = dotColour(axis, side, 1).map(decode);
      return lms.map((row) => row[0] * rgb[0]! + row[1] * rgb[1]! + row[2] * rgb[2]!);
    };
    for (const [index, axis] of (["protan", "deutan", "tritan"] as const).entries()) {
      const figure = excitation(axis, 1);
      const ground = excitation(axis, -1);
      for (let cone = 0; cone < 3; cone++) {
        const contrast = Math.abs(figure[cone]! / ground[cone]! - 1);
        if (cone === index) expect(contrast).toBeGreaterThan(0.1);
        else expect(contrast).toBeLessThan(0.02);
      }
    }
  });

  it("invert matrices", () => {
    const inverted = inverse([
      [2, 0, 0],
      [0, 4, 0],
      [1, 0, 1],
    ]);
    expect(inverted.map((row) => row.map((value) => value + 0))).toEqual([
      [0.5, 0, 0],
      [0, 0.25, 0],
      [-0.5, 0, 1],
    ]);
  });

  it("make gaps of a minute of arc for logMAR 0", () => {
    // 700 mm · tan(1′) = 0.2036 mm.
    expect(gapPx(0, 700, 1)).toBeCloseTo(0.2036, 4);
    expect(gapPx(0.3, 700, 4)).toBeCloseTo(0.2036 * 4 * 10 ** 0.3, 3);
  });
});
