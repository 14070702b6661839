/** Reads the form of an estimate. */
import type { EstimateOptions } from "../data/estimate-types";
import type { ProblemItem } from "../data/types";

/** What a form gives, or what is wrong with it, in words. */
export type ReadForm = { options: EstimateOptions } | { faults: ProblemItem[] };

const WORDS = ["sex", "hands", "definition", "bands"] as const;

/** Reads the fields; empty ones are left for the service to assume and to say so. */
export function estimateOptions(given: FormData): ReadForm {
  const faults: ProblemItem[] = [];
  const text = (key: string) => String(given.get(key) ?? "").trim();
  const number = (key: string, label: string): number | undefined => {
    if (text(key) === "") return undefined;
    const value = Number(text(key));
    if (Number.isFinite(value)) return value;
    faults.push({ detail: `${label} is not a number.`, expected: "a number", got: text(key) });
    return undefined;
  };
  const height = number("height_m", "Height");
  if (text("height_m") === "")
    faults.push({ detail: "The height is missing: it scales the body." });
  const mass = number("mass_kg", "Mass");
  const clock = number("clock_offset_s", "The plates’ clock");
  const from = number("tare_from", "The start of the tare");
  const to = number("tare_to", "The end of the tare");
  if ((text("tare_from") === "") !== (text("tare_to") === "")) {
    faults.push({ detail: "A tare has a start and an end, in seconds: one of them is missing." });
  } else if (from !== undefined && to !== undefined && from >= to) {
    faults.push({
      detail: "The tare ends before it starts.",
      expected: `more than ${from} s`,
      got: `${to} s`,
    });
  }
  if (faults.length > 0) return { faults };
  const accept = text("accept")
    .split(/[\s,]+/)
    .filter(Boolean);
  const words = WORDS.flatMap((key) => (text(key) === "" ? [] : [[key, text(key)]]));
  return {
    options: {
      height_m: height!,
      ...(mass === undefined ? {} : { mass_kg: mass }),
      ...(Object.fromEntries(words) as Record<string, string>),
      ...(from === undefined || to === undefined ? {} : { tare_s: [from, to] }),
      ...(clock === undefined ? {} : { clock_offset_s: clock }),
      ...(accept.length === 0 ? {} : { accept }),
    },
  };
}
