-- expect: 3: rd.option: argument 3 is a text; must be a list of values or { from = 1, to = 9 }, as in rd.option("n_rfe", 4)
local rd = require "refdyn"
local n = rd.option("n", 5, "5")
return rd.model { name = "wrong", links = { { "a", joint = "z", mass = n } } }
