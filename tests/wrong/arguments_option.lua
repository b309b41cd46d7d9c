-- expect: 3: rd.option: number of arguments is 4, 3 is needed; write rd.option("n_rfe", 4)
local rd = require "refdyn"
local n = rd.option("n", 5, { 5 }, 6)
return rd.model { name = "wrong", links = { { "a", joint = "z", mass = n } } }
