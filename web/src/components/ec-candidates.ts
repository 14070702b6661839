import { LitElement, type TemplateResult, css, html, nothing } from "lit";
import { customElement, property } from "lit/decorators.js";

import { counted, figure, seconds, unitWords } from "../common/format";
import { words } from "../common/names";
import { sharedStyles } from "../common/shared-styles";
import { meanRula, ranked } from "../common/verdict";
import type { Candidate, CostPart } from "../data/types";

const TONES = 5;

/**
 * The candidates in the order of their rank, one to choose.
 *
 * @fires candidate-select `detail` is the id of the one chosen, by click or by the arrow keys.
 */
@customElement("ec-candidates")
export class EcCandidates extends LitElement {
  @property({ attribute: false }) candidates: Candidate[] = [];
  @property() selected: string | null = null;
  /** Posture samples that the probabilities were counted over. */
  @property({ type: Number }) samples = 1;

  static override styles = [
    sharedStyles,
    css`
      :host {
        display: flex;
        flex-direction: column;
        min-height: 0;
        overflow: hidden;
      }
      .list {
        overflow-y: auto;
        flex: 1;
        padding: 0.35rem;
      }
      .row {
        display: grid;
        grid-template-columns: 1.9rem 1fr auto;
        gap: 0 0.5rem;
        padding: 0.55rem 0.65rem 0.6rem 0.4rem;
        border-radius: 8px;
        border: 1px solid transparent;
        cursor: pointer;
      }
      .row:hover {
        background: var(--sunken);
      }
      .row[aria-selected="true"] {
        background: var(--accent-soft);
        border-color: var(--accent);
      }
      .rank {
        font-size: 1.35rem;
        font-weight: 600;
        line-height: 1.25;
        text-align: center;
        color: var(--ink-soft);
      }
      .first .rank {
        color: var(--accent);
      }
      .name {
        font-weight: 590;
        overflow: hidden;
        text-overflow: ellipsis;
        white-space: nowrap;
      }
      .body {
        grid-column: 2 / -1;
      }
      .sure {
        display: flex;
        align-items: center;
        gap: 0.4rem;
      }
      .track {
        width: 3.4rem;
        height: 6px;
        border-radius: 3px;
        background: var(--line);
        overflow: hidden;
      }
      .fill {
        height: 100%;
        background: var(--accent);
      }
      .sure .number {
        min-width: 2.7rem;
        text-align: right;
        font-weight: 560;
      }
      .cost {
        display: flex;
        height: 9px;
        margin: 0.32rem 0 0.22rem;
        gap: 1px;
      }
      .cost span {
        height: 100%;
        min-width: 1px;
      }
      .cost span:first-child {
        border-radius: 2px 0 0 2px;
      }
      .cost span:last-child {
        border-radius: 0 2px 2px 0;
      }
      .tags {
        display: flex;
        flex-wrap: wrap;
        gap: 0.3rem;
        margin-top: 0.25rem;
      }
      .problem {
        color: var(--bad);
      }
      .problem .name,
      .problem .rank {
        color: var(--bad);
      }
      .problem p {
        overflow-wrap: anywhere;
      }
      .tone-1 {
        background: var(--part-1);
      }
      .tone-2 {
        background: var(--part-2);
      }
      .tone-3 {
        background: var(--part-3);
      }
      .tone-4 {
        background: var(--part-4);
      }
      .tone-5 {
        background: var(--part-5);
      }
      .key {
        display: flex;
        flex-wrap: wrap;
        gap: 0.15rem 0.8rem;
        padding: 0.5rem 0.9rem 0.6rem;
        border-top: 1px solid var(--line);
        font-size: 0.79rem;
        color: var(--ink-soft);
      }
      .key i {
        display: inline-block;
        width: 0.6rem;
        height: 0.6rem;
        border-radius: 2px;
        margin-right: 0.3rem;
      }
    `,
  ];

  override render() {
    const order = ranked(this.candidates);
    const largest = Math.max(0, ...order.map((candidate) => candidate.cost?.total ?? 0));
    const parts = order.find((candidate) => candidate.cost)?.cost?.parts ?? [];
    return html`
      <div
        class="list"
        role="listbox"
        tabindex="0"
        aria-label="Candidates, best first"
        aria-activedescendant=${this.selected === null ? nothing : this.#rowId(this.selected)}
        @keydown=${this.#onKey}
      >
        ${order.map((candidate) =>
          candidate.problem || candidate.rank === null
            ? this.#faulty(candidate)
            : this.#row(candidate, largest),
        )}
      </div>
      ${
        parts.length > 0
          ? html`<div class="key">
              <span>Cost:</span>
              ${parts.map(
                (part, index) =>
                  html`<span title=${explain(part)}
                    ><i class=${tone(index)}></i>${words(part.name)}</span
                  >`,
              )}
            </div>`
          : nothing
      }
    `;
  }

  override updated(): void {
    this.renderRoot
      .querySelector('[aria-selected="true"]')
      ?.scrollIntoView({ block: "nearest", inline: "nearest" });
  }

  #rowId(id: string): string {
    return `row-${this.candidates.findIndex((candidate) => candidate.id === id)}`;
  }

  #option(candidate: Candidate, kind: string, content: TemplateResult) {
    return html`<div
      id=${this.#rowId(candidate.id)}
      class="row ${kind}"
      role="option"
      data-candidate=${candidate.id}
      aria-selected=${candidate.id === this.selected ? "true" : "false"}
      @click=${() => this.#choose(candidate.id)}
    >
      ${content}
    </div>`;
  }

  #row(candidate: Candidate, largest: number) {
    const { cost, p_best: sure, worst } = candidate;
    const mean = meanRula(candidate);
    return this.#option(
      candidate,
      candidate.rank === 1 ? "first" : "",
      html`
        <span class="rank number">${candidate.rank}</span>
        <span class="name" title=${candidate.id}>${candidate.id}</span>
        ${
          sure === null
            ? html`<span></span>`
            : html`<span class="sure" title="Probability that this one is the best">
                <span class="track"
                  ><span class="fill" .style=${`display:block; width: ${100 * sure}%`}></span
                ></span>
                <span class="number small">${counted(sure, this.samples)}</span>
              </span>`
        }
        <div class="body">
          ${
            cost
              ? html`<div
                  class="cost"
                  role="img"
                  aria-label="Cost ${figure(cost.total)}"
                  title=${cost.parts.map(explain).join("\n")}
                >
                  ${cost.parts.map(
                    (part, index) =>
                      html`<span
                        class=${tone(index)}
                        .style=${`width: ${share(part, largest)}%`}
                      ></span>`,
                  )}
                </div>`
              : nothing
          }
          <div class="small soft number">
            ${cost ? html`cost ${figure(cost.total)}` : nothing}${
              mean === null ? nothing : html` · RULA ${mean.toFixed(1)}`
            }${
              worst?.rula === undefined || worst.rula === null
                ? nothing
                : html` · worst ${Math.round(worst.rula)} at ${seconds(worst.time_s, 1)}`
            }
          </div>
          ${this.#tags(candidate)}
        </div>
      `,
    );
  }

  #tags(candidate: Candidate) {
    const tied = candidate.tied_with;
    const strange = candidate.out_of_distribution?.flag ?? false;
    if (tied.length === 0 && !strange) return nothing;
    const shown = tied.slice(0, 2).join(", ") + (tied.length > 2 ? ` +${tied.length - 2}` : "");
    return html`<div class="tags">
      ${
        tied.length > 0
          ? html`<span class="tag" title="No clear difference between them: ${tied.join(", ")}"
              >≈ ties with ${shown}</span
            >`
          : nothing
      }
      ${
        strange
          ? html`<span class="tag warn" title="Postures unlike any in the demonstrations"
              >unfamiliar postures</span
            >`
          : nothing
      }
    </div>`;
  }

  #faulty(candidate: Candidate) {
    const problem = candidate.problem;
    return this.#option(
      candidate,
      "problem",
      html`
        <span class="rank" aria-hidden="true">!</span>
        <span class="name" title=${candidate.id}>${candidate.id}</span>
        <span class="small">not assessed</span>
        <div class="body small">
          <p><b>${problem?.title ?? "No rank"}</b></p>
          ${problem?.detail ? html`<p>${problem.detail}</p>` : nothing}
        </div>
      `,
    );
  }

  #choose(id: string): void {
    this.dispatchEvent(
      new CustomEvent("candidate-select", { detail: id, bubbles: true, composed: true }),
    );
  }

  #onKey(event: KeyboardEvent): void {
    const order = ranked(this.candidates);
    const index = order.findIndex((candidate) => candidate.id === this.selected);
    const goal = { ArrowDown: index + 1, ArrowUp: index - 1, Home: 0, End: order.length - 1 }[
      event.key
    ];
    if (goal === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    const next = order[Math.min(order.length - 1, Math.max(0, goal))];
    if (next) this.#choose(next.id);
  }
}

const tone = (index: number) => `tone-${(index % TONES) + 1}`;

const share = (part: CostPart, largest: number) =>
  largest > 0 ? Math.max(0, (100 * part.contribution) / largest) : 0;

function explain(part: CostPart): string {
  const unit = unitWords(part.unit);
  const how = part.aggregation ? ` (${part.aggregation})` : "";
  return `${words(part.name)}: ${figure(part.value)} ${unit}${how}, adds ${figure(part.contribution)}`;
}

declare global {
  interface HTMLElementTagNameMap {
    "ec-candidates": EcCandidates;
  }
}
