-- expect: 5: string.gmatch: more work than the 100 million steps that a model may take while it is read
-- Tries a search of quadratic time in a loop that looks harmless.
local rd = require "refdyn"
local s = ("a"):rep(1e5)
for a in s:gmatch("a-b") do end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
