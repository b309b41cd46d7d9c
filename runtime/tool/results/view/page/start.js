/*
 * Starts a page of recorded motions: reads the data, makes stage, charts and clock.
 */
"use strict";

const data = JSON.parse(byId("data").textContent);
const runs = data.runs.map(readRun);
runs.forEach((run) => Object.assign(run, tracePaths(run)));

const page = {
    stage: makeStage(byId("stage"), runs, data.palette, data.runs[0].up),
    charts: listCharts(runs, data.runs[0].up),
    rows: [],
    isStale: true,
    isCoarse: false,
    drawn: 0, /* time of the last picture [ms], like all times here */
    valuesShown: 0,
};

const longest = runs.reduce((most, run) => (run.t[run.t.length - 1] > most.t[most.t.length - 1] ? run : most));
const clock = makeClock(Math.min(...runs.map((run) => run.t[0])), longest.t[longest.t.length - 1], longest.t, moveAll);

startPage();
