-- expect: 5: string.find: more than the 100 million steps that reading a model may take
-- Tries %b without a closing bracket, from every place of a long text.
local rd = require "refdyn"
local s = ("("):rep(1e6)
s:find("%b()")
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
