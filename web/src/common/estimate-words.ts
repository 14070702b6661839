/** What an estimate comes to, in words. */
import type { EstimateSummary, Hold, Quantiles } from "../data/estimate-types";
import { figure, percent, seconds } from "./format";
import { inSentence, jointWords } from "./names";

const BANDS: Readonly<Record<string, string>> = {
  noise: "Bands are 5 to 95 % of the sensors’ noise alone.",
  noise_and_model: "Bands are 5 to 95 %: the sensors’ noise and errors of the body model.",
  tuning: "Bands are the 2021 paper’s preset: too narrow to be believed.",
  none: "This method gives no bands.",
};

const DEFINITIONS: Readonly<Record<string, string>> = {
  inertial: "what would hang and accelerate like it",
  vertical: "vertical force over gravity",
  norm: "size of the force over gravity",
};

export const definitionWords = (name: string) =>
  DEFINITIONS[name] ? `${name}: ${DEFINITIONS[name]}` : name;

/** Fixed digits; what rounds to zero has no sign. */
export const fixed = (value: number, digits = 2): string =>
  value.toFixed(digits).replace(/^-(0(\.0*)?)$/, "$1");

/** "3.03 to 6.88"; a dash where there is no band. */
export const span = (of: Quantiles, digits = 2): string =>
  of.p05 === null || of.p95 === null ? "–" : `${fixed(of.p05, digits)} to ${fixed(of.p95, digits)}`;

/** "4.96 kg (3.03 to 6.88)". */
export function kilograms(of: Quantiles): string {
  const band = of.p05 === null ? "" : ` (${span(of)})`;
  return `${fixed(of.p50)} kg${band}`;
}

/** How a hold's mass is shared out between the hands, or that it cannot be told. */
export function splitWords(hold: Hold): string {
  if (hold.split_kg) {
    return Object.entries(hold.split_kg)
      .map(([hand, mass]) => `${hand} ${fixed(mass)} kg`)
      .join(", ");
  }
  if (hold.hands.length < 2) return hold.hands.map((hand) => `${hand} hand alone`).join("");
  return hold.state === "loaded" ? "only the sum can be told" : "";
}

/** The answer in a sentence: what was carried, and when. */
export function headline(estimate: EstimateSummary): string {
  const { payload, holds } = estimate;
  if (payload.free_hands.length === 0) {
    const most = estimate.efforts[0];
    const peak = most
      ? `: most at the ${inSentence(jointWords(most.joint))}, ${figure(most.peak_nm.p50)} N·m`
      : "";
    return `What the body bears with empty hands${peak}`;
  }
  if (payload.known_share === 0) return "What the hands carry cannot be told";
  const loaded = holds.filter((hold) => hold.state === "loaded");
  const [first, ...more] = [...loaded].sort((a, b) => b.mass_kg.p50 - a.mass_kg.p50);
  if (first) {
    const when = `from ${seconds(first.start_s, 1)} to ${seconds(first.end_s, 1)}`;
    const times = more.length > 0 ? `, the most of ${loaded.length} holds` : "";
    return `${kilograms(first.mass_kg)} in the hands ${when}${times}`;
  }
  if (holds.length === 0) return "Nowhere is a load held long enough to be weighed";
  return "The hands carry nothing that shows";
}

/** What stands below the headline. */
export function facts(estimate: EstimateSummary): string[] {
  const { payload, person, feet } = estimate;
  const words = [
    `${estimate.source}: ${seconds(estimate.duration_s, 1)}, ${estimate.frames} frames at ` +
      `${Number(estimate.rate_hz.toFixed(2))} Hz${leftOut(estimate)}.`,
    BANDS[estimate.bands] ?? `Bands: ${estimate.bands}.`,
  ];
  if (payload.free_hands.length === 0) {
    words.push(
      `The hands were taken to be empty${feet ? "" : ", since nothing measured the feet"}: what ` +
        "they bear is missing in every figure.",
    );
  } else if (payload.known_share < 0.995) {
    words.push(
      payload.known_share === 0
        ? "Below stands what was found, and why."
        : `The payload can be told ${percent(payload.known_share)} of the time.`,
    );
  }
  const tared = Math.abs(person.model_mass_kg - person.mass_kg) > 0.005;
  const mass = `${figure(person.model_mass_kg)} kg${tared ? " after the tare" : ""}`;
  const gap = payload.plates_minus_model_kg;
  if (gap) {
    const less = gap.p50 < 0;
    const sizes =
      gap.p05 === null || gap.p95 === null
        ? ""
        : ` (${signed(gap.p05)} to ${signed(gap.p95)} over the frames)`;
    words.push(
      `By the median, the plates bear ${Math.abs(gap.p50).toFixed(2)} kg ${less ? "less" : "more"} than the ` +
        `body’s ${mass}${sizes}: what is carried and any error of body mass together.`,
    );
  } else if (feet) {
    words.push("The balance is never known, so the plates cannot check body mass.");
  }
  if (!estimate.options["tare_s"] && estimate.holds.some((hold) => hold.state === "loaded")) {
    words.push(
      "No tare was given: a kilogram too little in the body is a kilogram too much in the hands.",
    );
  }
  return words;
}

const signed = (value: number) => `${value < 0 ? "" : "+"}${value.toFixed(2)}`;

function leftOut(estimate: EstimateSummary): string {
  return Object.entries(estimate.left_out)
    .map(([why, count]) => `, ${count} left out (${why})`)
    .join("");
}

/** Which plate was whose foot, "plate 1, right foot: 0.0–0.7 s, 1.1–1.3 s". */
export function stanceWords(estimate: EstimateSummary): string[] {
  const seen = new Map<string, string[]>();
  for (const one of estimate.feet?.stances ?? []) {
    const key = `Plate ${one.plate}, ${one.foot} foot${one.given ? " (given)" : ""}`;
    const when = `${one.start_s.toFixed(1)}–${one.end_s.toFixed(1)} s`;
    seen.set(key, [...(seen.get(key) ?? []), when]);
  }
  return [...seen].map(([who, when]) => `${who}: ${when.join(", ")}`);
}

const BALANCE: Readonly<Record<string, string>> = {
  known: "known",
  split_unknown: "known of both feet together",
  unknown: "not known",
};

/** "Balance known 90 %, not known 10 % of the time". */
export function balanceWords(estimate: EstimateSummary): string {
  const parts = Object.entries(estimate.balance.share)
    .filter(([, share]) => share > 0)
    .map(([state, share]) => `${BALANCE[state] ?? state} ${percent(share)}`);
  return `Balance ${parts.join(", ")} of the time`;
}
