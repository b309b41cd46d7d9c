-- expect: 5: links[1].beam.rfe: value 1e+06; must be a whole number from 1 to 10000
-- Tries a beam of 10^6 elements.
local rd = require "refdyn"

return rd.model { name = "harmful", gravity = { 0, 0, -9.81 }, links = { { "a", joint = "theta", beam = { length = 1, section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = 1000000 } } } }
