-- expect: 3: rd.option: 4 arguments; must have at most 3, as in rd.option("n_rfe", 4)
local rd = require "refdyn"
local n = rd.option("n", 5, { 5 }, 6)
return rd.model { name = "wrong", links = { { "a", joint = "z", mass = n } } }
