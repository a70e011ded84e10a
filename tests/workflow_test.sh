#!/usr/bin/env bash
# workflow_test.sh WORKFLOW.yml NMSC: the workflow is YAML of the shape that GitHub Actions takes, its shell scripts are
# shell, and every nmsc command in it is one that exists. Exit code 77, skipped, without python3-yaml.
set -euo pipefail
if [[ $# -ne 2 ]]; then
  echo "usage: workflow_test.sh WORKFLOW.yml NMSC" >&2
  exit 2
fi
python3 -c 'import yaml' 2>/dev/null || { echo "skipped: no python3-yaml"; exit 77; }
python3 - "$@" <<'PY'
import re, subprocess, sys, yaml

path, nmsc = sys.argv[1:]
wrong = []


class Strict(yaml.SafeLoader):
    """Refuses a key that is given twice, which the second would silently win."""


def mapping(loader, node):
    keys = [loader.construct_object(k) for k, _ in node.value]
    for k in set(keys):
        if keys.count(k) > 1:
            wrong.append(f"line {node.start_mark.line + 1}: {k} is given twice")
    return dict(zip(keys, (loader.construct_object(v, deep=True) for _, v in node.value)))


Strict.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, mapping)
flow = yaml.load(open(path, encoding="utf-8"), Loader=Strict)


def known(what, of, *words):
    for key in of:
        if key not in words:
            wrong.append(f"{what} has {key!r}, which GitHub Actions does not know")


# `on` is a truth value in YAML 1.1.
known("the workflow", flow, "name", True, "on", "env", "jobs", "permissions", "defaults", "concurrency", "run-name")
if not (True in flow or "on" in flow):
    wrong.append("nothing sets it off")
events = flow.get(True, flow.get("on"))
for event in events if isinstance(events, (list, dict)) else [events]:
    if event not in ("push", "pull_request", "workflow_dispatch", "schedule", "release", "workflow_call"):
        wrong.append(f"{event!r} is no event")
jobs = flow.get("jobs") or {}
if not jobs:
    wrong.append("it has no jobs")
commands = set()
for name, job in jobs.items():
    known(f"job {name}", job, "name", "runs-on", "container", "needs", "if", "env", "steps", "strategy", "permissions",
          "timeout-minutes", "outputs", "defaults", "services", "continue-on-error", "concurrency", "environment")
    if "runs-on" not in job:
        wrong.append(f"job {name} runs nowhere")
    for i, step in enumerate(job.get("steps") or []):
        what = f"job {name}, step {step.get('name', i + 1)}"
        known(what, step, "name", "id", "if", "uses", "run", "with", "env", "shell", "working-directory",
              "continue-on-error", "timeout-minutes")
        if ("uses" in step) == ("run" in step):
            wrong.append(f"{what}: one of uses and run is needed")
        if "uses" in step and not re.fullmatch(r"[\w.-]+/[\w./-]+@[\w.-]+|\./.*|docker://.*", step["uses"]):
            wrong.append(f"{what}: {step['uses']} names no version")
        for text in [step.get("run", ""), step.get("if", "")] + list((step.get("env") or {}).values()):
            if str(text).count("${{") != str(text).count("}}"):
                wrong.append(f"{what}: an expression is not closed")
        if "run" in step:
            # Expressions are put in before the shell sees them.
            script = re.sub(r"\$\{\{.*?\}\}", "x", step["run"])
            shell = subprocess.run(["bash", "-n"], input=script, capture_output=True, text=True)
            if shell.returncode:
                wrong.append(f"{what}: {shell.stderr.strip()}")
            commands |= {tuple(m) for m in re.findall(r"(?:^|[|;&]\s*)nmsc ([a-z]+)((?: +(?:--[a-z-]+|[^\s|;&>]+))*)", script, re.M)}
if not commands:
    wrong.append("it runs no nmsc")
for command, rest in sorted(commands):
    told = subprocess.run([nmsc, command, "--help"], capture_output=True, text=True)
    every = subprocess.run([nmsc, "--help"], capture_output=True, text=True).stdout
    if told.returncode:
        wrong.append(f"nmsc has no command {command}")
    for option in re.findall(r"--[a-z-]+", rest):
        if option not in told.stdout and option not in every:
            wrong.append(f"nmsc {command} has no option {option}")
for line in wrong:
    print(f"wrong: {line}")
print(f"{path}: {len(jobs)} jobs, {len(commands)} nmsc commands")
sys.exit(1 if wrong else 0)
PY
