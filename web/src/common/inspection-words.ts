/** What the service read from a recording, in words. */
export interface InspectionWords {
  /** "60 Hz, 10.5 s, 630 frames". */
  facts: string;
  /** Conversions made at the door, and findings, most serious first. */
  notes: string[];
}

/** Reads an inspection; fields that are not there are passed over. */
export function inspectionWords(inspection: Readonly<Record<string, unknown>>): InspectionWords {
  const facts: string[] = [];
  const number = (key: string) =>
    typeof inspection[key] === "number" ? (inspection[key] as number) : null;
  const rate = number("rate_hz");
  const duration = number("duration_s");
  const frames = number("frames");
  if (rate !== null) facts.push(`${Number(rate.toFixed(2))} Hz`);
  if (duration !== null) facts.push(`${duration.toFixed(1)} s`);
  if (frames !== null) facts.push(`${frames} frames`);
  const notes = [...messages(inspection["problems"]), ...messages(inspection["notes"])];
  return { facts: facts.join(", "), notes: [...notes, ...messages(inspection["conversions"])] };
}

function messages(value: unknown): string[] {
  if (!Array.isArray(value)) return [];
  return value.flatMap((item: unknown) => {
    if (typeof item === "string") return [item];
    if (typeof item === "object" && item !== null && "message" in item)
      return [String(item.message)];
    return [];
  });
}
