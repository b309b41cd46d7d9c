-- expect: 4: option n: value "0"; must be a number from 1 to 9
-- set: n=0
local rd = require "refdyn"
local n = rd.option("n", 2, { from = 1, to = 9 })
return rd.model { name = "wrong", links = { { "a", joint = { "x" }, mass = n } } }
