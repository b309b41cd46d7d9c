-- expect: 3: rd.option: argument 2 is a table, a number, a text, true or false is needed; write rd.option("n_rfe", 4)
local rd = require "refdyn"
local n = rd.option("n", { 1 })
