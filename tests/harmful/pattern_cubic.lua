-- expect: 5: string.match: more than the 100 million steps that reading a model may take
-- Tries a pattern whose parts can share a text in many ways.
local rd = require "refdyn"
local s = ("a"):rep(3000)
s:match(".-.-.-b")
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
