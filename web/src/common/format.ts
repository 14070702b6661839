/** Numbers and their units as the page shows them. */

/** "78 %"; never rounds a doubt away to 0 or 100. */
export function percent(probability: number): string {
  if (probability > 0 && probability < 0.01) return "< 1 %";
  if (probability < 1 && probability > 0.99) return "> 99 %";
  return `${Math.round(probability * 100)} %`;
}

/**
 * A probability counted over samples: all or none of them still leaves room for one more that differs.
 *
 * @param samples How many were counted.
 */
export function counted(probability: number, samples: number): string {
  const least = 100 / Math.max(1, samples);
  if (100 * probability < least) return `< ${Math.max(1, Math.ceil(least))} %`;
  if (100 * probability > 100 - least) return `> ${Math.min(99, Math.floor(100 - least))} %`;
  return percent(probability);
}

/** "1.24 s". */
export const seconds = (time: number, digits = 2): string => `${time.toFixed(digits)} s`;

/** Three figures at most, without trailing noise: 0.0123, 1.23, 12.3, 123. */
export function figure(value: number): string {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 100) return value.toFixed(0);
  if (size >= 10) return value.toFixed(1);
  if (size >= 0.1) return value.toFixed(2);
  return value.toPrecision(2);
}

const UNITS: Readonly<Record<string, string>> = {
  "1": "",
  score: "",
  "share of reference": "of reference",
  "N*m": "N·m",
  Nm: "N·m",
  deg: "°",
};

/** A unit as it is printed; a pure number has none. */
export const unitWords = (unit: string): string => UNITS[unit] ?? unit;

/** Date and time in the reader's own spelling; the text itself where it is not a date. */
export function when(stamp: string): string {
  const date = new Date(stamp);
  if (Number.isNaN(date.getTime())) return stamp;
  return date.toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" });
}

/** A value of unknown kind in a few words: numbers short, lists and ranges joined, records flattened. */
export function anything(value: unknown): string {
  if (value === null || value === undefined || value === "") return "–";
  if (typeof value === "number") return Number.isInteger(value) ? String(value) : figure(value);
  if (typeof value === "boolean") return value ? "yes" : "no";
  if (Array.isArray(value)) {
    const numbers = value.every((item) => typeof item === "number");
    return value.map(anything).join(numbers && value.length === 2 ? " to " : ", ");
  }
  if (typeof value === "object") {
    return Object.entries(value)
      .map(([key, item]) => `${key.replaceAll("_", " ")} ${anything(item)}`)
      .join(", ");
  }
  return String(value);
}
