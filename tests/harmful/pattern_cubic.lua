-- expect: 5: string.match: more work than the 100 million steps that a model may take while it is read
-- Tries a pattern whose parts can share a text in many ways.
local rd = require "refdyn"
local s = ("a"):rep(3000)
s:match(".-.-.-b")
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
