-- expect: 5: string.gsub: more work than the 100 million steps that a model may take while it is read
-- Tries to build an empty text from a long replacement at every place.
local rd = require "refdyn"
local s, by = ("x"):rep(1e5), ("%1"):rep(1e5)
s:gsub("()", by)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
