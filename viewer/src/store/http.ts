/** Pieces of a store by HTTP, from any static host. */

import type { AbsolutePath, AsyncReadable, GetOptions, RangeQuery } from "zarrita";
import { StoreProblem } from "./errors";

/** A shard that comes whole from a host without ranges is cut here, up to this size. */
const LARGEST_WHOLE = 64 << 20;

export class HttpStore implements AsyncReadable {
  readonly url: URL;
  /** Metadata that came with the root's, by path; zarrita asks for no others. */
  readonly documents = new Map<string, Uint8Array>();
  /** How many requests were made. */
  requests = 0;

  constructor(url: string | URL) {
    this.url = new URL(url, globalThis.location?.href);
    if (!this.url.pathname.endsWith("/")) this.url.pathname += "/";
  }

  async get(key: AbsolutePath, options?: GetOptions): Promise<Uint8Array | undefined> {
    if (key.endsWith("/zarr.json")) {
      const known = this.documents.get(key);
      if (known || this.documents.size) return known;
    }
    const response = await this.#fetch(key, {}, options);
    return this.#body(key, response);
  }

  async getRange(key: AbsolutePath, range: RangeQuery, options?: GetOptions): Promise<Uint8Array> {
    const header =
      "suffixLength" in range
        ? `bytes=-${range.suffixLength}`
        : `bytes=${range.offset}-${range.offset + range.length - 1}`;
    const response = await this.#fetch(key, { Range: header }, options);
    const length = "suffixLength" in range ? range.suffixLength : range.length;
    if (response.status === 206) {
      const body = await this.#body(key, response);
      const told = /^bytes (\d+)-(\d+)\/(\d+|\*)$/.exec(response.headers.get("Content-Range") ?? "");
      const offset = "offset" in range ? range.offset : Number(told?.[3]) - length;
      // Hosts of other origins may hide the header; then the length has to do.
      const wrong = told && !Number.isNaN(offset) && Number(told[1]) !== offset;
      if (body.byteLength !== length || wrong) {
        throw new StoreProblem("damaged", this.#place(key), `asked for ${header}, got another range`);
      }
      return body;
    }
    // 200: the host ignored the range and sends the whole file, which must not be taken for the part.
    const size = Number(response.headers.get("Content-Length") ?? Number.POSITIVE_INFINITY);
    if (!(size <= LARGEST_WHOLE)) {
      await response.body?.cancel();
      throw new StoreProblem("no-ranges", this.#place(key));
    }
    const whole = await this.#body(key, response);
    const start = "offset" in range ? range.offset : whole.byteLength - length;
    if (start < 0 || start + length > whole.byteLength) {
      throw new StoreProblem("damaged", this.#place(key), "the file is shorter than its index says");
    }
    return whole.subarray(start, start + length);
  }

  #place(key: string): string {
    return new URL(key.slice(1), this.url).href;
  }

  async #fetch(key: string, headers: Record<string, string>, options?: GetOptions): Promise<Response> {
    const place = this.#place(key);
    this.requests++;
    let response: Response;
    try {
      response = await fetch(place, {
        headers,
        signal: options?.signal ?? null,
        credentials: "omit",
        // Metadata kept from before the store was published anew would not fit its chunks.
        cache: key.endsWith("/zarr.json") ? "no-cache" : "default",
      });
    } catch (error) {
      if (error instanceof Error && error.name === "AbortError") throw error;
      throw new StoreProblem("unreachable", place);
    }
    if (response.status === 404 || response.status === 410) throw new StoreProblem("missing", place);
    if (!response.ok) {
      throw new StoreProblem("refused", place, `${response.status} ${response.statusText}`.trim());
    }
    return response;
  }

  async #body(key: string, response: Response): Promise<Uint8Array> {
    try {
      return new Uint8Array(await response.arrayBuffer());
    } catch (error) {
      if (error instanceof Error && error.name === "AbortError") throw error;
      throw new StoreProblem("damaged", this.#place(key), "the connection broke off");
    }
  }
}
