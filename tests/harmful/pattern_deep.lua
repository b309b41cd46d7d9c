-- expect: 5: string.match: more than the 100 million steps that reading a model may take
-- Tries to let the matching of a pattern recurse too deep.
local rd = require "refdyn"
local s = ("a"):rep(1e5)
s:match(("(a)"):rep(30) .. ("a?"):rep(1e4))
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
