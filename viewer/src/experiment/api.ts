// What the page says to the server. Nothing is given up: a request is repeated until the server has answered,
// and an answer is kept in the browser until the server has acknowledged it.

export type Choice = "left" | "right" | "tie";

export interface Viewing {
  display: string;
  profile: string;
  luminance_cd_m2: number | null;
  distance_mm: number | null;
  surround: string;
}

export interface SessionInfo {
  title: string;
  consent: string;
  instructions: string;
  layout: "beside" | "alternating";
  ties: boolean;
  minimum_view_s: number;
  adaptation_s: number;
  vision_checks: boolean;
  display_check: boolean;
  viewing: Viewing;
  width_px: number;
  height_px: number;
  done: string[];
  answered: number;
  total: number;
}

export interface Trial {
  token: string;
  number: number;
  total: number;
  practice: boolean;
  pause: boolean;
  reference: string;
  left: string;
  right: string;
  ahead: string[];
}

export interface Answer {
  token: string;
  choice: Choice;
  response_s: number;
  window: {
    width: number;
    height: number;
    device_pixel_ratio: number;
    full_screen: boolean;
    input: "key" | "mouse" | "touch" | "pen";
  };
}

/** The server refused: the request is wrong, and repeating it would not help. */
export class Refused extends Error {
  constructor(
    readonly status: number,
    detail: string,
  ) {
    super(detail);
  }
}

const TIMEOUT_MS = 10_000;
const FIRST_PAUSE_MS = 500;
const LONGEST_PAUSE_MS = 4_000;

const pause = (ms: number) => new Promise<void>((resolve) => setTimeout(resolve, ms));

/** Fetch, again and again while the connection or the server is away; `waiting` hears whether it is. */
export async function persistently(
  request: () => Promise<Response>,
  waiting: (away: boolean) => void,
  wait: (ms: number) => Promise<void> = pause,
): Promise<Response> {
  for (let ms = FIRST_PAUSE_MS; ; ms = Math.min(2 * ms, LONGEST_PAUSE_MS)) {
    let response: Response | undefined;
    try {
      response = await request();
    } catch {
      response = undefined; // no connection, or no answer in time
    }
    if (response !== undefined && response.status !== 429 && response.status < 500) {
      waiting(false);
      if (response.ok) return response;
      const body: unknown = await response.json().catch(() => null);
      const detail = body !== null && typeof body === "object" && "detail" in body ? body.detail : null;
      throw new Refused(response.status, typeof detail === "string" ? detail : response.statusText);
    }
    waiting(true);
    await wait(ms);
  }
}

/** The session that a code opens. */
export class Session {
  constructor(
    readonly code: string,
    private readonly waiting: (away: boolean) => void,
    private readonly kept: Storage = localStorage,
  ) {}

  private async request(method: string, path: string, body?: unknown): Promise<Response> {
    return persistently(
      () =>
        fetch(`/api/session${path}`, {
          method,
          headers: {
            Authorization: `Bearer ${this.code}`,
            ...(body === undefined ? {} : { "Content-Type": "application/json" }),
          },
          signal: AbortSignal.timeout(TIMEOUT_MS),
          ...(body === undefined ? {} : { body: JSON.stringify(body) }),
        }),
      this.waiting,
    );
  }

  async describe(): Promise<SessionInfo> {
    return (await this.request("GET", "")).json();
  }

  async step(name: string, data: object): Promise<void> {
    await this.request("POST", "/steps", { name, ...data });
  }

  async picture(digest: string): Promise<Blob> {
    return (await this.request("GET", `/pictures/${digest}`)).blob();
  }

  /** Return the first trial without an answer, after the one that was given when the page was last closed. */
  async next(): Promise<Trial | null> {
    const kept = this.kept.getItem(this.key);
    if (kept !== null) {
      try {
        return await this.send(JSON.parse(kept) as Answer);
      } catch (error) {
        if (!(error instanceof Refused) || error.status === 401) throw error;
        // The trial is gone, as after a deletion: there is nothing left to answer.
      }
    }
    return (await (await this.request("POST", "/next")).json()).trial;
  }

  /** Store an answer, and return the next trial. */
  async answer(answer: Answer): Promise<Trial | null> {
    this.kept.setItem(this.key, JSON.stringify(answer));
    return this.send(answer);
  }

  private async send(answer: Answer): Promise<Trial | null> {
    try {
      return (await (await this.request("POST", "/answers", answer)).json()).trial;
    } finally {
      // Reached when the server has taken or refused it, and not while it is away.
      this.kept.removeItem(this.key);
    }
  }

  private get key(): string {
    return `impasto-answer-${this.code}`;
  }
}
