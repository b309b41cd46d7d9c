-- expect: 6: attempt to compare number with nil
-- Tries to change a list while it is sorted.
local rd = require "refdyn"
local t = {}
for i = 1, 1e5 do t[i] = i % 7 end
for i = 1, 1e6 do table.sort(t, function(a, b) t[#t + 1] = a; t[1] = nil; return a < b end) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
