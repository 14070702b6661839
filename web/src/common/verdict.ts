/**
 * The answer in a sentence, drawn from an assessment: which candidate to take, how sure, and why.
 */
import type { Assessment, Candidate } from "../data/types";
import { atLeast, meanOverTime } from "./distributions";
import { counted, figure, percent, unitWords } from "./format";
import { inSentence, jointWords, words } from "./names";

export interface Verdict {
  /** Candidates to take: one, or several where nothing tells them apart. */
  take: readonly string[];
  headline: string;
  reasons: readonly string[];
}

/** Candidates in the order of their rank; those without one (faulty) last, as sent. */
export function ranked(candidates: readonly Candidate[]): Candidate[] {
  return [...candidates].sort((a, b) => (a.rank ?? Infinity) - (b.rank ?? Infinity) || 0);
}

/** Mean over time of the expected RULA score. */
export function meanRula(candidate: Candidate): number | null {
  const rula = candidate.rula;
  return rula ? meanOverTime(rula.time_s, rula.expected) : null;
}

/** Share of the time, expected, that RULA stands at 5 or above. */
export function shareAtFive(candidate: Candidate): number | null {
  const rula = candidate.rula;
  if (!rula) return null;
  return meanOverTime(rula.time_s, rula.p_ge_5 ?? rula.pmf.map((pmf) => atLeast(pmf, 5)));
}

/** The joint with the largest median effort of a candidate, and that effort in N·m. */
export function peakEffort(candidate: Candidate): { joint: string; effort: number } | null {
  let peak: { joint: string; effort: number } | null = null;
  for (const [joint, band] of Object.entries(candidate.effort_nm ?? {})) {
    for (const effort of band.p50) {
      if (peak === null || effort > peak.effort) peak = { joint, effort };
    }
  }
  return peak;
}

/** The cost part that sets `better` most apart from `worse`, where it does so in favour. */
function decidingPart(better: Candidate, worse: Candidate): string | null {
  let widest = 0;
  let text: string | null = null;
  for (const part of better.cost?.parts ?? []) {
    const other = worse.cost?.parts.find((candidate) => candidate.name === part.name);
    if (!other) continue;
    const gain = other.contribution - part.contribution;
    if (gain > widest) {
      widest = gain;
      const unit = unitWords(part.unit);
      const space = unit === "" || unit === "°" ? "" : " ";
      text =
        `${inSentence(words(part.name))} ${figure(part.value)}${space}${unit}` +
        ` against ${figure(other.value)}${space}${unit}`;
    }
  }
  return text;
}

const list = (names: readonly string[]) =>
  names.length < 2
    ? names.join("")
    : `${names.slice(0, -1).join(", ")} or ${names[names.length - 1]!}`;

/** Sums an assessment up. */
export function verdictOf(assessment: Assessment): Verdict {
  const order = ranked(assessment.candidates).filter((candidate) => candidate.rank !== null);
  const best = order[0];
  const faulty = assessment.candidates.length - order.length;
  if (!best) {
    return {
      take: [],
      headline: "None of these candidates can be assessed",
      reasons: ["Each one's problem is written beside it."],
    };
  }
  const reasons: string[] = [];
  const tied = best.tied_with.filter((id) => order.some((candidate) => candidate.id === id));
  const take = [best.id, ...tied];
  let headline: string;
  if (order.length === 1) {
    headline = `Only ${best.id} can be assessed`;
  } else if (tied.length > 0) {
    headline = `Take ${list(take)}: nothing tells them apart`;
  } else {
    const sure = best.p_best === null ? "" : `, ${counted(best.p_best, assessment.samples)} sure`;
    headline = `Take ${best.id}: least load${sure}`;
  }
  const rival = order.find((candidate) => !take.includes(candidate.id));
  if (rival) {
    const part = decidingPart(best, rival);
    if (part) reasons.push(`What decides over ${rival.id}: ${part}.`);
  }
  const share = shareAtFive(best);
  const mean = meanRula(best);
  const peak = peakEffort(best);
  const facts: string[] = [];
  if (mean !== null) facts.push(`RULA ${mean.toFixed(1)} on average`);
  if (share !== null) facts.push(`at 5 or above ${percent(share)} of the time`);
  if (peak) {
    const joint = inSentence(jointWords(peak.joint));
    facts.push(`most effort at the ${joint}, ${figure(peak.effort)} N·m`);
  }
  if (facts.length > 0) reasons.push(`${facts.join(", ")}.`);
  if (best.out_of_distribution?.flag) {
    reasons.push("It leads through postures unlike any in the demonstrations: trust it less.");
  }
  if (faulty > 0) {
    reasons.push(`${faulty} of ${assessment.candidates.length} could not be assessed.`);
  }
  return { take, headline, reasons };
}
