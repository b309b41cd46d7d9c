-- expect: 6: table.concat: more than the 100 million steps that reading a model may take
-- Tries to make table.concat visit a million empty texts again and again.
local rd = require "refdyn"
local t = {}
for i = 1, 1e6 do t[i] = "" end
for i = 1, 1e6 do table.concat(t) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
