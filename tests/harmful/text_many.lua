-- expect: 5: string.rep: more than the 100 million steps that reading a model may take
-- Tries many texts of some kB.
local rd = require "refdyn"
local t = {}
for i = 1, 1e9 do t[i] = ("x"):rep(4000) .. i end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
