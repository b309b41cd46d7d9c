-- expect: 6: more than 100 million steps to read the model; look for a loop without an end
-- Tries the length of a list in a loop.
local rd = require "refdyn"
local t, n = {}, 0
for i = 1, 1e6 do t[i] = i end
while true do n = n + #t end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
