-- expect: 3: rd.option: argument 2 is a table; must be a number, a text, true or false, as in rd.option("n_rfe", 4)
local rd = require "refdyn"
local n = rd.option("n", { 1 })
