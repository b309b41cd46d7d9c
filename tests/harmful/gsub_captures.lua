-- expect: 5: string.gsub: more than the 100 million steps that reading a model may take
-- Tries to build an empty text from a long replacement at every place.
local rd = require "refdyn"
local s, by = ("x"):rep(1e5), ("%1"):rep(1e5)
s:gsub("()", by)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
