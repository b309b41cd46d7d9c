-- expect: 4: more than 10000 entries in a table
-- Tries a beam of 100,000 segments.
local rd = require "refdyn"
local t = {}
for i = 1, 1e5 do t[i] = { length = 1e-3, rfe = 1 } end
return rd.model { name = "harmful", gravity = { 0, 0, -9.81 }, links = { { "a", joint = "theta", beam = { section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, segments = t } } } }
