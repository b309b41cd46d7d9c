-- expect: 5: string.find: more work than the 100 million steps that a model may take while it is read
-- Tries to compare long captures at every place.
local rd = require "refdyn"
local s = ("a"):rep(1e5)
s:find("(a*)b%1")
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
