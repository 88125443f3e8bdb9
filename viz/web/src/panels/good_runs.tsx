// How the run that failed differs from good ones: a line for each value, with a sentence.

import { useEffect, useState } from "preact/hooks";
import { placed } from "#core/good_runs.ts";
import { isFile } from "#core/page_file.ts";
import { ask, isFailure, link } from "#core/requests.ts";
import { store } from "#core/store.ts";
import { shorten } from "#core/text.ts";
import type { Answers, Fact, GoodRuns } from "#core/wire.ts";

const MOST_FACTS = 8;

export function GoodRunsPart() {
  const [found, setFound] = useState<GoodRuns | null>(null);
  useEffect(() => {
    let open = !isFile();
    const read = async () => {
      const answer = await ask<Answers["GET /api/good"]>(link("good"));
      if (open && !isFailure(answer)) setFound(answer);
    };
    if (open) read();
    return () => {
      open = false;
    };
  }, []);
  if (!found?.path || !found.runs) return null;
  const facts = [...found.facts].sort((a, b) => Number(b.differs) - Number(a.differs));
  return (
    <div class="good-runs">
      <h3>
        {store.data.nameOf(found.path)} in {found.runs} good run{found.runs === 1 ? "" : "s"}
      </h3>
      <p class={facts.some(({ differs }) => differs) ? "conclusion" : "hint"}>{shorten(found.text, 400)}</p>
      {facts.slice(0, MOST_FACTS).map((fact) => (
        <FactLine key={fact.name} fact={fact} />
      ))}
    </div>
  );
}

function FactLine({ fact }: { fact: Fact }) {
  const line = placed(fact);
  const text = (value: number) => `${Number(value.toPrecision(3))}${fact.unit && ` ${fact.unit}`}`;
  const goodText = `${text(Math.min(...fact.good))} to ${text(Math.max(...fact.good))}`;
  return (
    <div class={fact.differs ? "fact differs" : "fact"}>
      <span>
        <b>{shorten(fact.name, 30)}</b> here <b class="here">{shorten(fact.here, 60)}</b>
      </span>
      {line ? (
        <>
          <svg role="img" aria-label={`good runs ${goodText}, here ${fact.here}`}>
            <line x1="0" x2="100%" y1="10" y2="10" />
            <rect
              x={`${100 * line.box[0]}%`}
              width={`${100 * Math.max(0.004, line.box[1] - line.box[0])}%`}
              y="3"
              height="14"
              rx="3"
            />
            {line.dots.map((x) => (
              <circle cx={`${100 * x}%`} cy="10" r="2.5" />
            ))}
            <text x={`${100 * line.here}%`} y="10.5">
              ◆
            </text>
          </svg>
          <small>
            <span>{text(line.low)}</span>
            <span>{text(line.high)}</span>
          </small>
        </>
      ) : (
        <small>good: {fact.texts.map((one) => shorten(one, 40)).join(", ")}</small>
      )}
    </div>
  );
}
