-- expect: 4: more than 10000 entries in a table
-- Tries a chain of 50,000 links in reverse order.
local rd = require "refdyn"
local t, n = {}, 50000
for i = 1, n do t[i] = { "a" .. i, on = i < n and "a" .. i + 1 or nil, joint = "x", mass = 1 } end
return rd.model { name = "harmful", links = t }
