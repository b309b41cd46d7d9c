-- expect: 5: string.gmatch: more than the 100 million steps that reading a model may take
-- Tries a search of quadratic time in a loop that looks harmless.
local rd = require "refdyn"
local s = ("a"):rep(1e5)
for a in s:gmatch("a-b") do end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
