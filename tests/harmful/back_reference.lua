-- expect: 5: string.find: more than the 100 million steps that reading a model may take
-- Tries to compare long captures at every place.
local rd = require "refdyn"
local s = ("a"):rep(1e5)
s:find("(a*)b%1")
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
