-- expect: 5: string.find: more than the 100 million steps that reading a model may take
-- Tries to search a long text in a longer one of the same letter.
local rd = require "refdyn"
local s, what = ("a"):rep(1e6), ("a"):rep(5e5) .. "b"
for i = 1, 1e6 do s:find(what, 1, true) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
