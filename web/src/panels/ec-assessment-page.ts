import { LitElement, type PropertyValues, css, html, nothing } from "lit";
import { customElement, property, query, state } from "lit/decorators.js";

import { Playback } from "../common/playback";
import { distinctMoments, jointOfMoment } from "../common/moment-words";
import { handleKey } from "../common/page-keys";
import { sharedStyles } from "../common/shared-styles";
import { peakEffort, ranked, verdictOf } from "../common/verdict";
import "../components/ec-assumed";
import "../components/ec-baselines";
import "../components/ec-candidates";
import "../components/ec-cost";
import "../components/ec-held-out";
import "../components/ec-moments";
import "../components/ec-player";
import "../components/ec-problem";
import { getAssessment, getModel, getPosture, getText, modelUrdfUrl } from "../data/api";
import { asProblem } from "../data/problems";
import type { Assessment, Candidate, ModelSummary, Moment, Posture, Problem } from "../data/types";
import "./ec-candidate-plots";
import { pageStyles } from "./page-styles";
import type { EcPlayer } from "../components/ec-player";

/**
 * One assessment: the answer, the candidates, and the chosen one on the body and over time.
 *
 * @fires candidate-select When another candidate is chosen; the address follows.
 */
@customElement("ec-assessment-page")
export class EcAssessmentPage extends LitElement {
  @property() assessmentId = "";
  /** Candidate that the address names; the best one where it names none. */
  @property() candidateId: string | null = null;

  @state() private assessment: Assessment | null = null;
  @state() private model: ModelSummary | null = null;
  @state() private urdf = "";
  @state() private posture: Posture | null = null;
  @state() private joint: string | null = null;
  @state() private problem: Problem | null = null;
  @state() private postureProblem: Problem | null = null;
  @state() private busy = false;
  @query("ec-player") readonly player!: EcPlayer;

  readonly playback = new Playback();
  #loading: AbortController | null = null;

  static override styles = [
    sharedStyles,
    pageStyles,
    css`
      .about {
        margin-top: 0.35rem;
        font-size: 0.86rem;
      }
      .flag {
        background: var(--warn-soft);
        color: var(--warn);
        border-radius: 7px;
        padding: 0.4rem 0.8rem;
        font-size: 0.93rem;
      }
    `,
  ];

  override connectedCallback(): void {
    super.connectedCallback();
    window.addEventListener("keydown", this.#onKey);
  }

  override disconnectedCallback(): void {
    super.disconnectedCallback();
    window.removeEventListener("keydown", this.#onKey);
    this.playback.pause();
    this.#loading?.abort();
  }

  override willUpdate(changed: PropertyValues<this>): void {
    if (changed.has("assessmentId")) void this.#load();
    else if (changed.has("candidateId")) void this.#show();
  }

  /** The candidate that is shown. */
  get candidate(): Candidate | null {
    const all = this.assessment?.candidates ?? [];
    return all.find((item) => item.id === this.candidateId) ?? ranked(all)[0] ?? null;
  }

  override render() {
    if (this.problem) {
      return html`<main>
        <div class="empty"><ec-problem .problem=${this.problem}></ec-problem></div>
      </main>`;
    }
    const assessment = this.assessment;
    const candidate = this.candidate;
    if (!assessment || !candidate) return html`<main><p class="empty soft">Loading…</p></main>`;
    const verdict = verdictOf(assessment);
    const worst = candidate.worst ? [candidate.worst] : [];
    const moments = distinctMoments(candidate.moments?.length ? candidate.moments : worst);
    return html`
      <main>
        <section class="answer">
          <h1>${verdict.headline}</h1>
          <p>${verdict.reasons.join(" ")}</p>
          ${this.#about(assessment)}
        </section>
        <div class="left">
          <ec-candidates
            class="card grow"
            .candidates=${assessment.candidates}
            .samples=${assessment.samples}
            .selected=${candidate.id}
          ></ec-candidates>
        </div>
        <div class="body">
          ${this.#warning(candidate)}
          ${
            candidate.problem || this.postureProblem
              ? html`<ec-problem .problem=${candidate.problem ?? this.postureProblem}></ec-problem>`
              : nothing
          }
          <ec-player
            class="card grow"
            ?hidden=${candidate.problem !== null}
            .urdf=${this.urdf}
            .posture=${this.posture}
            .playback=${this.playback}
            .joint=${this.joint}
            .hand=${this.model?.hand === "left" ? "left" : "right"}
            .busy=${this.busy}
            @joint-select=${(event: CustomEvent<string>) => {
              this.joint = event.detail;
            }}
          ></ec-player>
          ${
            candidate.problem
              ? nothing
              : html`<section class="card moments" aria-label="Worst moments">
                  <h2>Worst moments</h2>
                  <ec-moments
                    .moments=${moments}
                    .playback=${this.playback}
                    @moment-select=${this.#onMoment}
                  ></ec-moments>
                </section>`
          }
        </div>
        <div class="plots">
          <ec-candidate-plots
            class="card grow"
            ?hidden=${candidate.problem !== null}
            .candidate=${candidate}
            .compare=${this.#rival(candidate)}
            .joint=${this.joint}
            .playback=${this.playback}
            @joint-select=${(event: CustomEvent<string>) => {
              this.joint = event.detail;
            }}
          ></ec-candidate-plots>
        </div>
        <div class="more">
          <section class="card">
            <h2>Assumed, not measured</h2>
            <ec-assumed
              .assumed=${[...(assessment.assumed ?? []), ...(candidate.assumed ?? [])]}
            ></ec-assumed>
          </section>
          <section class="card">
            ${
              candidate.cost
                ? html`<h2>What ${candidate.id} costs</h2>
                    <ec-cost .candidate=${candidate}></ec-cost>`
                : nothing
            }
            <h2>What simpler predictors say of ${candidate.id}</h2>
            <ec-baselines
              .candidates=${assessment.candidates}
              .selected=${candidate.id}
              .method=${this.model?.method ?? assessment.methods[0] ?? ""}
            ></ec-baselines>
            <ec-held-out .metrics=${this.model?.metrics ?? null}></ec-held-out>
          </section>
        </div>
      </main>
    `;
  }

  #about(assessment: Assessment) {
    const subject = this.model?.subject;
    const person = [
      this.model?.name ?? assessment.model_id,
      subject?.height_m ? `${subject.height_m.toFixed(2)} m` : "",
      subject?.mass_kg ? `${subject.mass_kg.toFixed(0)} kg` : "",
      this.model ? (this.model.hand === "both" ? "both hands" : `${this.model.hand} hand`) : "",
    ].filter(Boolean);
    return html`<p class="about number">
      Predicted for ${person.join(", ")} from ${assessment.samples} posture samples, seed
      ${assessment.seed}.
    </p>`;
  }

  #warning(candidate: Candidate) {
    const strange = candidate.out_of_distribution;
    if (!strange?.flag) return nothing;
    const at =
      strange.time_s === null || strange.time_s === undefined
        ? ""
        : ` most so at ${strange.time_s.toFixed(2)} s`;
    return html`<p class="flag" role="note">
      Unlike the demonstrations,${at || " in places"}: trust the prediction less there.
    </p>`;
  }

  /** What the chosen one is compared with in the plots: the best, or the runner-up of the best. */
  #rival(candidate: Candidate): Candidate | null {
    const order = ranked(this.assessment?.candidates ?? []).filter((item) => item.rank !== null);
    return order.find((item) => item.id !== candidate.id) ?? null;
  }

  async #load(): Promise<void> {
    this.assessment = null;
    this.posture = null;
    this.problem = null;
    try {
      const assessment = await getAssessment(this.assessmentId);
      if (assessment.id !== this.assessmentId && this.assessment !== null) return;
      this.assessment = assessment;
      void this.#show();
      // The first look falls on what matters most.
      this.playback.seek(this.candidate?.worst?.time_s ?? 0);
      [this.model, this.urdf] = await Promise.all([
        getModel(assessment.model_id),
        getText(modelUrdfUrl(assessment.model_id)),
      ]);
    } catch (cause) {
      const problem = asProblem(cause);
      if (this.assessment) this.postureProblem = problem;
      else this.problem = problem;
    }
  }

  /** Fetches the posture of the chosen candidate; a newer choice overtakes an older one. */
  async #show(): Promise<void> {
    const { assessment, candidate } = this;
    this.#loading?.abort();
    if (!assessment || !candidate) return;
    this.postureProblem = null;
    this.#keepJoint(candidate);
    const times = candidate.rula?.time_s;
    this.playback.load(times?.[0] ?? 0, times?.[times.length - 1] ?? 0);
    if (candidate.problem) {
      this.posture = null;
      return;
    }
    const loading = new AbortController();
    this.#loading = loading;
    this.busy = true;
    try {
      this.posture = await getPosture(assessment.id, candidate.id, loading.signal);
    } catch (cause) {
      if (loading.signal.aborted) return;
      this.posture = null;
      this.postureProblem = asProblem(cause);
    } finally {
      if (this.#loading === loading) this.busy = false;
    }
  }

  /** Keeps the chosen joint from one candidate to the next; starts with the most loaded one. */
  #keepJoint(candidate: Candidate): void {
    const joints = candidate.effort_nm ?? {};
    if (this.joint !== null && this.joint in joints) return;
    this.joint = peakEffort(candidate)?.joint ?? null;
  }

  #onMoment(event: CustomEvent<Moment>): void {
    const joint = jointOfMoment(event.detail);
    if (joint !== null && joint in (this.candidate?.effort_nm ?? {})) this.joint = joint;
  }

  #onKey = (event: KeyboardEvent): void => {
    handleKey(event, this.playback);
  };
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-assessment-page": EcAssessmentPage;
  }
}
