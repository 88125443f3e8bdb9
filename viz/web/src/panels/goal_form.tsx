// The fields of a goal as a form; core/goal_values.js converts their values.

import type { ComponentChildren } from "preact";
import { type FormState, isOneText, listIn, problemOf, problemText, toState, treeIn } from "#core/goal_values.ts";
import type { FieldProblem, FormField, Json } from "#core/types.ts";
import { fieldValue } from "#panels/components.tsx";

const MOST_ROWS = 200; // of an array
const FEW = 4; // numbers that can share a line

/** The properties of all parts of the form; `state` is changed in place. */
export type Shared = {
  path: string;
  problems: FieldProblem[];
  disabled: boolean;
  onChange: () => void;
};

export function Fields({
  fields,
  path = "$",
  ...shared
}: Partial<Shared> & Omit<Shared, "path"> & { fields: FormField[]; state: FormState }) {
  return (
    <>
      {fields.map((field) => (
        <Field key={field.name} field={field} path={`${path}.${field.name}`} {...shared} />
      ))}
    </>
  );
}

function Field({ field, state, ...shared }: Shared & { field: FormField; state: FormState }) {
  const { path, problems, onChange } = shared;
  const value = state[field.name];
  const put = (changed: Json) => {
    state[field.name] = changed;
    onChange();
  };
  if (field.array && !isOneText(field)) return <Rows field={field} value={listIn(value)} put={put} {...shared} />;
  if (field.kind === "message") return <Group field={field} name={field.name} state={treeIn(value)} {...shared} />;
  const problem = problemOf(problems, path, field);
  return (
    <div class={`field ${problem ? "bad" : ""}`}>
      <label for={path}>{field.name}</label>
      <Type field={field} />
      <Input field={field} value={value} put={put} bad={Boolean(problem)} {...shared} />
      <Comment field={field} path={path} />
      <Problem path={path} text={problem && problemText(problem, value)} />
    </div>
  );
}

const Type = ({ field }: { field: FormField }) => <span class="type">{field.type}</span>;

function Comment({ field, path }: { field: FormField; path: string }) {
  const unit = { time: "seconds, or now", duration: "seconds" }[field.base];
  const notes = [field.comment, isOneText(field) && "separated by commas", unit].filter(Boolean);
  return notes.length ? (
    <small class="comment" id={`${path}?`}>
      {notes.join("; ")}
    </small>
  ) : null;
}

const Problem = ({ path, text }: { path: string; text: string | null }) =>
  text ? (
    <p class="problem" id={`${path}!`}>
      {text}
    </p>
  ) : null;

function Input({
  field,
  path,
  value,
  put,
  bad,
  disabled,
  label,
}: {
  field: FormField;
  path: string;
  value: Json;
  put: (value: Json) => void;
  bad: boolean;
  disabled: boolean;
  label?: string;
}) {
  const isNumber = field.kind === "float" || field.kind === "integer";
  const shared = {
    id: path,
    disabled,
    "data-path": path,
    "aria-invalid": bad,
    "aria-label": label,
    "aria-describedby": `${path}? ${path}!`,
  };
  const onCheck = (e: Event) => put((e.target as HTMLInputElement).checked);
  if (field.kind === "bool" && !field.array)
    return <input type="checkbox" {...shared} checked={String(value) === "true"} onChange={onCheck} />;
  const input = (
    <input
      type="text"
      {...shared}
      value={String(value)}
      spellcheck={false}
      autocomplete="off"
      inputmode={isNumber ? "decimal" : undefined}
      class={field.kind === "string" ? "" : "number-input"}
      placeholder={field.array ? "empty" : ""}
      onInput={(e: Event) => put(fieldValue(e))}
    />
  );
  if (!field.choices.length || field.array) return input;
  return (
    <span class="choice">
      <Constants field={field} value={value} put={put} disabled={disabled} />
      {input}
    </span>
  );
}

/** A choice of the constants that are meant for a field. */
function Constants({
  field,
  value,
  put,
  disabled,
}: {
  field: FormField;
  value: Json;
  put: (value: Json) => void;
  disabled: boolean;
}) {
  const text = String(value).trim();
  const isKnown = field.choices.some((choice) => choice.value === text);
  const onChange = (e: Event) => {
    if (fieldValue(e) !== "") put(fieldValue(e));
  };
  return (
    <select
      aria-label={`constants for ${field.name}`}
      disabled={disabled}
      value={isKnown ? text : ""}
      onChange={onChange}
    >
      {!isKnown && <option value="">another value</option>}
      {field.choices.map((choice) => {
        const comment = choice.comment ? ` \u2013 ${choice.comment}` : "";
        const text = `${choice.name} = ${choice.value}${comment}`;
        return (
          <option value={choice.value} title={choice.comment}>
            {text}
          </option>
        );
      })}
    </select>
  );
}

/** A message inside the goal; a few numbers, such as a point, share a line. */
function Group({
  field,
  name,
  state,
  after,
  ...shared
}: Shared & { field: FormField; name: string; state: FormState; after?: ComponentChildren }) {
  const fields = field.fields ?? [];
  const isFew = fields.length <= FEW && fields.every((one) => one.kind === "float" && !one.array);
  const comment = field.comment || field.about;
  return (
    <fieldset class={`group-field ${isFew ? "few" : ""}`}>
      <legend>
        {name} <Type field={field} />
        {after}
      </legend>
      {comment && <small class="comment">{comment}</small>}
      <Problem path={shared.path} text={problemOf(shared.problems, shared.path)} />
      <div class="inside-group">
        <Fields fields={fields} state={state} {...shared} />
      </div>
      {!fields.length && <small class="comment">no fields</small>}
    </fieldset>
  );
}

/** An array of texts or messages, with a row for each. */
function Rows({
  field,
  value,
  put,
  ...shared
}: Shared & { field: FormField; value: Json[]; put: (value: Json) => void }) {
  const { path, problems, disabled } = shared;
  const isFixed = field.array?.length != null;
  const add = () => put([...value, field.kind === "message" ? toState(field.fields ?? [], field.default ?? {}) : ""]);
  const remove = (i: number) => (
    <button
      type="button"
      class="small"
      disabled={disabled}
      aria-label={`remove ${field.name} ${i + 1}`}
      onClick={() => put(value.filter((_, n) => n !== i))}
    >
      −
    </button>
  );
  const inner = { ...field, array: null };
  const row = (item: Json, i: number) => {
    const at = { ...shared, path: `${path}[${i}]` };
    const name = `${field.name} ${i + 1}`;
    const after = isFixed ? null : remove(i);
    if (field.kind === "message")
      return <Group key={i} field={inner} name={name} state={treeIn(item)} after={after} {...at} />;
    const problem = problemOf(problems, at.path);
    const putItem = (text: Json) => put(value.map((old, n) => (n === i ? text : old)));
    return (
      <div class={`field row-field ${problem ? "bad" : ""}`} key={i}>
        <Input field={inner} value={item} bad={Boolean(problem)} label={name} put={putItem} {...at} />
        {after}
        <Problem path={at.path} text={problem} />
      </div>
    );
  };
  return (
    <fieldset class="group-field rows-field">
      <legend>
        {field.name} <Type field={field} />
      </legend>
      {field.comment && <small class="comment">{field.comment}</small>}
      <Problem path={path} text={problemOf(problems, path)} />
      {value.map(row)}
      {!isFixed && (
        <button type="button" class="small" disabled={disabled || value.length >= MOST_ROWS} onClick={add}>
          + {field.name}
        </button>
      )}
    </fieldset>
  );
}
