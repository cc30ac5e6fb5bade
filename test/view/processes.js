// The component, a simulated robot and pocd_view as processes on a domain of their own.
"use strict";
const { spawn } = require("child_process");
const path = require("path");

const top = path.resolve(process.env.POCD_SOURCE);
const bin = process.env.POCD_BIN;
const started = new Set();
process.on("exit", () => started.forEach((one) => one.child.kill("SIGKILL")));
for (const signal of ["SIGTERM", "SIGINT", "SIGHUP"]) process.on(signal, () => process.exit(1));

/** Far more than anything takes; only a test that fails gets there. */
const kGenerous = 120000;

class Program {
  constructor(name, args) {
    this.name = name;
    this.text = "";
    this.child = spawn(path.join(bin, name), args, { cwd: top, stdio: ["ignore", "pipe", "pipe"] });
    started.add(this);
    for (const stream of [this.child.stdout, this.child.stderr]) stream.on("data", (data) => { this.text += data; });
    this.ended = new Promise((resolve) => this.child.on("exit", (code, signal) => {
      started.delete(this);
      resolve(code ?? signal);
    }));
  }
  async says(pattern) {
    let found;
    await until(() => (found = pattern.exec(this.text)), `${this.name} says ${pattern}`);
    return found;
  }
  async end(signal = "SIGTERM") {
    this.child.kill(signal);
    return this.ended;
  }
}

async function until(condition, what, time = kGenerous) {
  for (const end = Date.now() + time; Date.now() < end;) {
    if (await condition()) return;
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
  throw new Error(`never came: ${what}`);
}

const node = (...more) => new Program("pocd_node", ["--config", "config/simulated.yaml", ...more]);
const play = (scenario, ...more) => new Program("pocd_play", ["--dataset", "sim", "--input", scenario, "--no-color", ...more]);
async function view(...more) {
  const program = new Program("pocd_view", more);
  program.address = (await program.says(/http:\S+/))[0];
  return program;
}

let checks = 0;
function check(condition, what) {
  ++checks;
  if (!condition) throw new Error(`not so: ${what}`);
}

async function main(run) {
  try {
    await run();
    console.log(`${checks} checks passed`);
    process.exit(0);
  } catch (error) {
    console.error(error.stack);
    for (const one of started) console.error(`--- ${one.name}:\n${one.text.slice(-2000)}`);
    process.exit(1);
  }
}

module.exports = { Program, until, node, play, view, check, main };
