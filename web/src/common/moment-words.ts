import type { Moment } from "../data/types";
import { jointWords, words } from "./names";

/** Joint that bears a body part, without its side. */
const JOINT_OF_PART: Readonly<Record<string, string>> = {
  "upper arm": "Shoulder",
  "lower arm": "Elbow",
  wrist: "Wrist",
  "forearm twist": "Elbow",
  trunk: "L5S1",
  neck: "T1C7",
};

/** A moment in pieces: the part of the body, what is the matter with it, and whatever adds to that. */
export interface MomentWords {
  part: string;
  matter: string;
  more: string[];
}

/**
 * Splits the service's sentences, which name score, action level, part and points themselves: the
 * list shows the score beside them already, and the part in bold.
 */
export function momentWords(moment: Moment): MomentWords {
  const [first = "", ...more] = moment.reason ? [moment.reason] : (moment.reasons ?? []);
  const part = moment.body_part === "none" ? "" : (moment.body_part ?? "");
  const whole = part.replace(/^(right|left) /, "");
  let matter = first.replace(/^(RULA|REBA) \d+ \([^)]*\): /, "");
  for (const name of [part, whole]) {
    if (name !== "" && matter.startsWith(`${name} `)) matter = matter.slice(name.length + 1);
  }
  const named = /^j[A-Z]/.test(part) ? jointWords(part) : words(part);
  return {
    part: named || (moment.side ? words(moment.side) : ""),
    matter: pointsLast(matter),
    more: more.filter((reason) => reason !== first).map((reason) => reason.replaceAll("_", " ")),
  };
}

/** "2: flexion 28° (20° to 45°); +1: abducted" becomes "flexion 28° (20° to 45°), 2 points; +1: abducted". */
const pointsLast = (text: string) =>
  text.replace(
    /^(\d+): ([^;]+)/,
    (_, points: string, what: string) =>
      `${what}, ${points} ${points === "1" ? "point" : "points"}`,
  );

/** Moments that differ in more than their time: of those that say the same, the first. */
export function distinctMoments(moments: readonly Moment[]): Moment[] {
  const seen = new Set<string>();
  return moments.filter((moment) => {
    const { part, matter } = momentWords(moment);
    const key = `${part}|${matter}|${moment.score ?? moment.rula}`;
    if (seen.has(key)) return false;
    seen.add(key);
    return true;
  });
}

/** The joint to look at for a moment; null where the part has none. */
export function jointOfMoment(moment: Moment): string | null {
  if (moment.effort_joint) return moment.effort_joint;
  const part = (moment.body_part ?? "").replace(/^(right|left) /, "");
  const joint = JOINT_OF_PART[part];
  if (joint === undefined) return null;
  if (joint === "L5S1" || joint === "T1C7") return `j${joint}`;
  const side = /^(right|left) /.exec(moment.body_part ?? "")?.[1] ?? moment.side;
  if (side !== "right" && side !== "left") return null;
  return `j${side === "right" ? "Right" : "Left"}${joint}`;
}
