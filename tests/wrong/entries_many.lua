-- expect: 3: more entries in a table than 10000
local rd = require "refdyn"
local t = {}
for i = 1, 10001 do t[i] = { "p" .. i, 1 } end
local p = rd.parameters(t)
