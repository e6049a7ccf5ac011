// The page of an observer: from the code to the thanks, and from wherever it stopped.

import { initJsPsych } from "jspsych";
import { checkAcuity } from "./acuity";
import { type Answer, Refused, Session, type SessionInfo, type Trial } from "./api";
import { adapt, askForCode, askForConsent, askForViewing, instruct, pause, thank } from "./before";
import { checkColourVision } from "./colour-vision";
import { PairedComparison } from "./comparison";
import { checkDisplay } from "./display-check";
import { Pictures } from "./pictures";
import { Screen } from "./screen";
import "./experiment.css";

const CODE = "impasto-code";
const USUAL_DISTANCE_MM = 600;
const USUAL_PX_PER_MM = 96 / 25.4;
const BETWEEN_MS = 300;

const stage = document.getElementById("stage")!;
const notice = document.getElementById("notice")!;

function tell(text: string): void {
  notice.textContent = text;
  notice.hidden = text === "";
}

function waiting(away: boolean): void {
  tell(away ? "No connection at the moment. Your answer is kept; this page goes on by itself." : "");
}

/** Return the session of the code in the address or of this window, or of one that is typed. */
async function open(): Promise<[Session, SessionInfo]> {
  let code = decodeURIComponent(location.hash.slice(1)) || sessionStorage.getItem(CODE) || "";
  let message = "Please type the code that you were given.";
  for (;;) {
    code = code.replace(/[\s-]/g, "").toUpperCase();
    if (/^[0-9A-Z]{1,40}$/.test(code)) {
      const session = new Session(code, waiting);
      try {
        const described = await session.describe();
        sessionStorage.setItem(CODE, code);
        history.replaceState(null, "", `#${code}`);
        return [session, described];
      } catch (error) {
        if (!(error instanceof Refused)) throw error;
      }
    }
    if (code !== "") message = "This code opens no session. Please type the code that you were given.";
    code = await askForCode(stage, message);
  }
}

async function run(): Promise<void> {
  const [session, described] = await open();
  document.title = described.title;
  if (described.answered === described.total) return thank(stage);
  const pictures = new Pictures((digest) => session.picture(digest));
  let next: Trial | null = null;
  let pxPerMm = USUAL_PX_PER_MM;

  const screen = (show: (display: HTMLElement) => Promise<object>) => ({ type: Screen, show });
  /** A screen whose findings are stored once; who comes again does not see it. */
  const step = (name: string, wanted: boolean, show: (display: HTMLElement) => Promise<object>) =>
    wanted && !described.done.includes(name)
      ? [
          screen(async (display) => {
            const found = await show(display);
            await session.step(name, found);
            return found;
          }),
        ]
      : [];

  const jsPsych = initJsPsych({ display_element: stage });
  await jsPsych.run([
    ...step("consent", true, (display) => askForConsent(display, described)),
    ...step("viewing", true, (display) => askForViewing(display, described)),
    ...step("display", described.display_check, async (display) => {
      const found = await checkDisplay(display);
      pxPerMm = found.px_per_mm ?? pxPerMm;
      return found;
    }),
    ...step("colour_vision", described.vision_checks, checkColourVision),
    ...step("acuity", described.vision_checks, (display) =>
      checkAcuity(display, described.viewing.distance_mm ?? USUAL_DISTANCE_MM, pxPerMm),
    ),
    screen((display) => instruct(display, described)),
    screen(async (display) => {
      // The first pictures are fetched while the eyes get used to the field.
      const first = session.next();
      const [trial, found] = await Promise.all([
        first.then((trial) => {
          if (trial !== null) pictures.expect([trial.reference, trial.left, trial.right, ...trial.ahead], []);
          return trial;
        }),
        adapt(display, described.adaptation_s),
      ]);
      next = trial;
      await session.step("adaptation", found);
      return found;
    }),
    {
      conditional_function: () => next !== null,
      loop_function: () => next !== null,
      timeline: [
        {
          conditional_function: () => next!.pause,
          timeline: [screen((display) => pause(display, next!.number - 1, next!.total))],
        },
        {
          type: PairedComparison,
          shown: () => next,
          session: described,
          pictures,
        },
        {
          type: Screen,
          show: async () => {
            const { answer } = jsPsych.data.getLastTrialData().values()[0] as { answer: Answer };
            const [following] = await Promise.all([
              session.answer(answer),
              new Promise((resolve) => setTimeout(resolve, BETWEEN_MS)),
            ]);
            next = following;
            return {};
          },
        },
      ],
    },
  ]);
  if (document.fullscreenElement !== null) await document.exitFullscreen().catch(() => undefined);
  thank(stage);
}

run().catch((error: unknown) => {
  if (error instanceof Refused && error.status === 401) {
    return tell("The laboratory has deleted this session, with its answers. Please call the experimenter.");
  }
  const reason = error instanceof Error ? error.message : String(error);
  tell(`The page cannot go on: ${reason}. Your answers so far are stored. Please call the experimenter.`);
});
