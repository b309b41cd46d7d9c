-- expect: 3: option n_rfe: value inf; must be finite
local rd = require "refdyn"
local n = rd.option("n_rfe", 1e400, { from = 2 })
return rd.model { name = "wrong", links = { { "a", joint = "psi", beam = {
  length = 1, section = rd.round(0.01), E = 2e11, nu = 0.3, rho = 7800, rfe = n } } } }
