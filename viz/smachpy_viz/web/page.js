// node_modules/preact/dist/preact.mjs
var n;
var t;
var r;
var u;
var i;
var f;
var o;
var e;
var l;
var c;
var a;
var s;
var h = /* @__PURE__ */ Symbol.for("pv");
var p = {};
var y = [];
var v = /^m(i|n|o|s|text|space)$/;
var w = Array.isArray;
var d = y.slice;
var _ = Object.assign;
function g(n3) {
  n3 && n3.parentNode && n3.remove();
}
function k(n3, t4, r4) {
  var u4, i4, f5, o5 = {}, e4 = arguments.length;
  for (f5 in t4) "key" == f5 ? u4 = t4[f5] : "ref" == f5 && "function" != typeof n3 ? i4 = t4[f5] : o5[f5] = t4[f5];
  return e4 > 2 && (o5.children = e4 > 3 ? d.call(arguments, 2) : r4), m(n3, o5, u4, i4, null);
}
function m(r4, u4, i4, f5, o5) {
  var e4 = { type: r4, props: u4, key: i4, ref: f5, __k: null, __: null, __b: 0, __e: null, __c: null, constructor: h, __v: o5 || ++t, __i: -1, __u: 0 };
  return !o5 && n.vnode && n.vnode(e4), e4;
}
function $(n3) {
  return n3.children;
}
function x(n3, t4) {
  this.props = n3, this.context = t4, this.__g = 0;
}
function S(n3, t4) {
  if (null == t4) return n3.__ && S(n3.__, n3.__i + 1);
  for (var r4; t4 < n3.__k.length; t4++) if ((r4 = n3.__k[t4]) && r4.__e) return r4.__e;
  return "function" != typeof n3.type || n3.props.__P ? null : S(n3);
}
function C(t4) {
  var r4, u4 = t4.__v, i4 = u4.__e, f5 = [], o5 = [], e4 = t4.__P;
  e4 && ((r4 = _({ constructor: h }, u4)).__v = u4.__v + 1, n.vnode && n.vnode(r4), z(e4, r4, u4, t4.__n, e4.namespaceURI, 32 & u4.__u ? [i4] : null, f5, i4 || S(u4), 32 & u4.__u, o5), r4.__v = u4.__v, r4.__.__k[r4.__i] = r4, E(f5, r4, o5), u4.__ = u4.__e = null, r4.__e != i4 && j(r4));
}
function j(n3) {
  if ((n3 = n3.__) && n3.__c && !n3.props.__P) return n3.__e = null, n3.__k.some(function(t4) {
    return t4 && (n3.__e = t4.__e);
  }), j(n3);
}
function L(t4) {
  (8 & t4.__g || (t4.__g |= 8, u.push(t4), f++)) && i == n.debounceRendering || ((i = n.debounceRendering) || queueMicrotask)(H);
}
function H() {
  try {
    for (var n3, t4 = 1; u.length; ) u.length > t4 && u.sort(o), n3 = u.shift(), t4 = u.length, 8 & n3.__g && C(n3);
  } finally {
    (f = u.length) && (i || queueMicrotask)(H);
  }
}
function I(n3, t4, r4, u4, i4, f5, o5, e4, l4, c4, a5) {
  var s4, h5, v4, w5, d5, _5, g5 = u4.__k || y, k4 = t4.length;
  for (l4 = q(r4, t4, g5, l4, k4), s4 = 0; s4 < k4; s4++) null != (v4 = r4.__k[s4]) && (h5 = ~v4.__i && g5[v4.__i] || p, v4.__i = s4, _5 = z(n3, v4, h5, i4, f5, o5, e4, l4, c4, a5), w5 = v4.__e, (h5.ref != v4.ref || 8 & h5.__u) && (h5.ref && G(h5.ref, null, v4, h5), v4.ref && a5.push(v4.ref, v4.__c || w5, v4)), d5 = d5 || w5, 4 & v4.__u ? (l4 = A(v4, l4, n3, !h5.__v), h5.__e && (h5.__e = null)) : "function" == typeof v4.type && void 0 !== _5 ? l4 = _5 : w5 && (l4 = w5.nextSibling), v4.__u &= -21);
  return r4.__e = d5, l4;
}
function q(n3, t4, r4, u4, i4) {
  var f5, o5, e4, l4, c4, a5, s4, p5, y5, v4 = r4.length, d5 = v4, _5 = 0, g5 = 0, k4 = n3.__k = Array(i4);
  for (f5 = 0; f5 < i4; f5++) null != (o5 = t4[f5]) && "boolean" != typeof o5 && "function" != typeof o5 ? ("object" != typeof o5 || o5.constructor === String ? o5 = k4[f5] = m(null, o5) : w(o5) ? o5 = k4[f5] = m($, { children: o5 }) : o5.constructor === h && o5.__b ? o5 = k4[f5] = m(o5.type, o5.props, o5.key, o5.ref, o5.__v) : k4[f5] = o5, l4 = f5 + _5, o5.__ = n3, o5.__b = n3.__b + 1, e4 = null, ~(c4 = o5.__i = P(o5, r4, l4, d5)) && (d5--, (e4 = r4[c4]) && (e4.__u |= 2)), e4 && e4.__v ? (o5.__u |= 16, c4 == l4 - 1 ? _5-- : c4 == l4 + 1 ? _5++ : c4 != l4 && (c4 > l4 ? _5-- : _5++, g5 = 1)) : (~c4 || (i4 > v4 ? _5-- : i4 < v4 && _5++), "function" != typeof o5.type && (o5.__u |= 4))) : k4[f5] = null;
  if (g5) {
    for (a5 = [], s4 = [], f5 = 0; f5 < i4; f5++) if ((o5 = k4[f5]) && 16 & o5.__u) {
      for (_5 = 0, p5 = a5.length; _5 < p5; ) a5[y5 = _5 + p5 >> 1] < o5.__i ? _5 = y5 + 1 : p5 = y5;
      a5[_5] = o5.__i, s4[f5] = _5 + 1;
    }
    for (_5 = a5.length; f5--; ) s4[f5] && (s4[f5] == _5 ? _5-- : k4[f5].__u |= 4);
  }
  if (d5) for (f5 = 0; f5 < v4; f5++) !(e4 = r4[f5]) || 2 & e4.__u || (e4.__e == u4 && (u4 = S(e4)), J(e4, e4));
  return u4;
}
function A(n3, t4, r4, u4) {
  var i4, f5, o5, e4;
  if ("function" == typeof n3.type) {
    if (n3.props.__P) return t4;
    if (i4 = n3.__k) for (f5 = 0; f5 < i4.length; f5++) i4[f5] && (i4[f5].__ = n3, t4 = A(i4[f5], t4, r4, false));
    return t4;
  }
  for (t4 && !t4.parentNode && (t4 = S(n3)) && !t4.parentNode && (t4 = null), o5 = n3.__e, e4 = t4; e4 && 8 == e4.nodeType; ) e4 = e4.nextSibling;
  for (o5 != e4 && (!u4 && r4.moveBefore && o5.parentNode ? r4.moveBefore(o5, t4) : r4.insertBefore(o5, t4 || null)), t4 = o5; (t4 = t4 && t4.nextSibling) && 8 == t4.nodeType && !t4.data.startsWith("$s"); ) ;
  return t4;
}
function P(n3, t4, r4, u4) {
  var i4, f5 = n3.key, o5 = n3.type, e4 = t4[r4], l4 = e4 && !(2 & e4.__u);
  if (null === e4 && null == f5 || l4 && f5 == e4.key && o5 == e4.type) return r4;
  if (u4 > (l4 ? 1 : 0)) {
    for (i4 = r4 - 1; i4 >= 0; i4--) if ((e4 = t4[i4]) && !(2 & e4.__u) && f5 == e4.key && o5 == e4.type) return i4;
    for (i4 = r4 + 1; i4 < t4.length; i4++) if ((e4 = t4[i4]) && !(2 & e4.__u) && f5 == e4.key && o5 == e4.type) return i4;
  }
  return -1;
}
function T(n3, t4, r4) {
  null == r4 && (r4 = ""), "-" == t4[0] ? n3.setProperty(t4, r4) : n3[t4] = r4;
}
function N(n3, t4, r4, u4, i4) {
  var f5, o5;
  if ("style" == t4) if ("string" == typeof r4) n3.style.cssText = r4;
  else {
    if ("string" == typeof u4 && (n3.style.cssText = u4 = ""), u4) for (t4 in u4) r4 && t4 in r4 || T(n3.style, t4);
    if (r4) for (t4 in r4) u4 && r4[t4] == u4[t4] || T(n3.style, t4, r4[t4]);
  }
  else if ("o" == t4[0] && "n" == t4[1]) "function" != typeof r4 && (r4 = null), "function" != typeof u4 && (u4 = null), (n3.__e || (n3.__e = {}))[t4] = r4, r4 && u4 || (o5 = a[t4] || (a[t4] = V(t4)), (n3.__a || (n3.__a = {}))[t4] = c, f5 = t4 != (t4 = t4.replace(l, "$1")), (t4 = t4.slice(2))[0] < "a" && (t4 = t4.toLowerCase()), r4 ? n3.addEventListener(t4, o5, f5) : n3.removeEventListener(t4, o5, f5));
  else {
    if ("http://www.w3.org/2000/svg" == i4) t4 = t4.replace(/xlink(H|:h)/, "h").replace(/sName$/, "s");
    else if ("width" != t4 && "height" != t4 && "href" != t4 && "list" != t4 && "form" != t4 && "tabIndex" != t4 && "download" != t4 && "rowSpan" != t4 && "colSpan" != t4 && "role" != t4 && "popover" != t4 && t4 in n3) try {
      return void (n3[t4] = null == r4 ? "" : r4);
    } catch (n4) {
    }
    if ("function" == typeof r4) return;
    null == r4 || false === r4 && "-" != t4[4] ? n3.removeAttribute(t4) : n3.setAttribute(t4, "popover" == t4 && 1 == r4 ? "" : r4);
  }
}
function V(t4) {
  return function(r4) {
    var u4 = this.__e;
    if (u4) {
      if (u4 = u4[t4], null == r4[e]) r4[e] = c++;
      else if (r4[e] < this.__a[t4]) return;
      return u4(n.event ? n.event(r4) : r4);
    }
  };
}
function z(t4, r4, u4, i4, f5, o5, e4, l4, c4, a5) {
  var s4, p5, v4, d5, k4, b3, m5, M3, C3, j3, L2, H2, q2, A4, O2, P2, T4, N2, V2 = r4.type;
  if (r4.constructor !== h) return null;
  128 & u4.__u && (c4 = 32 & u4.__u, s4 = u4.__c.__z) && (r4.__u |= c4, p5 = o5 = [], 8 == s4.nodeType ? l4 = B(s4, o5) : o5.push(s4), l4 = o5[0] || l4), (s4 = n.__b) && s4(r4);
  n: if ("function" == typeof V2) {
    v4 = e4.length;
    try {
      if (M3 = r4.props, C3 = (s4 = V2.prototype) && s4.render, j3 = (s4 = V2.contextType) && i4[s4.__c], L2 = s4 ? j3 ? j3.props.value : s4.__ : i4, (d5 = u4.__c) ? (r4.__c = d5, 2 & d5.__g && (d5.__g |= 1)) : (C3 ? r4.__c = d5 = new V2(M3, L2) : (r4.__c = d5 = new x(M3, L2), d5.constructor = V2, d5.render = K), j3 && j3.sub(d5), d5.state || (d5.state = {}), d5.__n = i4, d5.__g |= 8, d5.__h = [], d5.__k = []), C3 && (d5.__s || (d5.__s = d5.state), V2.getDerivedStateFromProps && (d5.__s == d5.state && (d5.__s = _({}, d5.__s)), _(d5.__s, V2.getDerivedStateFromProps(M3, d5.__s)))), k4 = d5.props, b3 = d5.state, d5.__v = r4, u4.__c) {
        if (M3 !== k4 && C3 && !V2.getDerivedStateFromProps && d5.componentWillReceiveProps && d5.componentWillReceiveProps(M3, L2), r4.__v == u4.__v && !(8 & d5.__g) || !(4 & d5.__g) && d5.shouldComponentUpdate && false === d5.shouldComponentUpdate(M3, d5.__s, L2)) {
          r4.__v != u4.__v && (d5.props = M3, d5.state = d5.__s, d5.__g &= -9), r4.__e = u4.__e, r4.__k = u4.__k, r4.__k.some(function(n3) {
            n3 && (n3.__ = r4);
          }), y.push.apply(d5.__h, d5.__k), d5.__k = [], d5.__h.length && e4.push(d5), l4 = S(u4);
          break n;
        }
        d5.componentWillUpdate && d5.componentWillUpdate(M3, d5.__s, L2), C3 && d5.componentDidUpdate && d5.__h.push(function() {
          d5.componentDidUpdate(k4, b3, m5);
        });
      } else C3 && !V2.getDerivedStateFromProps && d5.componentWillMount && d5.componentWillMount(), C3 && d5.componentDidMount && d5.__h.push(d5.componentDidMount);
      d5.context = L2, d5.props = M3, d5.__P = t4, d5.__g &= -5, H2 = n.__r, q2 = C3 ? 25 : 0;
      do {
        d5.__g &= -9, H2 && H2(r4), s4 = d5.render(d5.props, d5.state = d5.__s, d5.context);
      } while (8 & d5.__g && ++q2 < 25);
      C3 && (y.push.apply(d5.__h, d5.__k), d5.__k = []), d5.state = d5.__s, d5.getChildContext && (i4 = _({}, i4, d5.getChildContext())), C3 && u4.__c && d5.getSnapshotBeforeUpdate && (m5 = d5.getSnapshotBeforeUpdate(k4, b3)), A4 = s4 && s4.type === $ && null == s4.key ? s4.props.children : s4, M3.__P && (s4 = l4, f5 = (t4 = M3.__P).namespaceURI, c4 = o5 = null, u4.props && u4.props.__P != t4 && (u4.__k.some(function(n3) {
        n3 && J(n3, n3);
      }), u4.__k = null), l4 = u4.__k ? S(u4, 0) : null), l4 = I(t4, w(A4) ? A4 : [A4], r4, u4, i4, f5, o5, e4, l4, c4, a5), M3.__P && (r4.__e = null, l4 = s4), r4.__u &= -161, p5 && p5.some(g), d5.__h.length && e4.push(d5), 1 & d5.__g && (d5.__g &= -4);
    } catch (t5) {
      if (e4.length = v4, r4.__v = null, c4 || o5) if (t5 && t5.then) {
        if (r4.__u |= 128 | c4, o5) {
          for (~(T4 = o5.indexOf(l4 || void 0)) || (T4 = o5.length); (N2 = o5[T4 - 1]) && 8 == N2.nodeType; ) T4--;
          for (; T4 < o5.length; T4++) if (N2 = o5[T4]) if (o5[T4] = null, O2) {
            if (N2 == P2) break;
          } else {
            if (8 != N2.nodeType) break;
            N2.data.startsWith("$s") && (P2 = B(O2 = N2));
          }
        }
        if (!O2) {
          for (; l4 && 8 == l4.nodeType && l4.nextSibling; ) l4 = l4.nextSibling;
          O2 = l4;
        }
        (s4 = B(O2 = r4.__c.__z || (r4.__c.__z = O2))) ? (r4.__e = O2, l4 = s4) : r4.__e = l4, l4 = l4 && l4.nextSibling;
      } else o5 && o5.some(g);
      else r4.__e = u4.__e;
      r4.__k || (r4.__k = u4.__k || []), t5 && t5.then || D(r4), n.__e(t5, r4, u4);
    }
  } else l4 = r4.__e = F(u4.__e, r4, u4, i4, f5, o5, e4, c4, a5, t4);
  return (s4 = n.diffed) && s4(r4), l4;
}
function B(n3, t4) {
  if (n3 && 8 == n3.nodeType && n3.data.startsWith("$s")) for (var r4 = 1; n3 = n3.nextSibling; ) {
    if (8 == n3.nodeType) {
      if (n3.data.startsWith("$s")) r4++;
      else if (n3.data.startsWith("/$s") && !--r4) return n3;
    }
    t4 && t4.push(n3);
  }
}
function D(n3) {
  n3 && (n3.__c && (n3.__c.__g |= 4), n3.__k && n3.__k.some(D));
}
function E(t4, r4, u4) {
  for (var i4 = 0; i4 < u4.length; ) G(u4[i4++], u4[i4++], u4[i4++]);
  n.__c && n.__c(r4, t4), t4.some(function(r5) {
    try {
      t4 = r5.__h, r5.__h = [], t4.some(function(n3) {
        n3.call(r5);
      });
    } catch (t5) {
      n.__e(t5, r5.__v);
    }
  });
}
function F(t4, r4, u4, i4, f5, o5, e4, l4, c4, a5) {
  var s4, h5, y5, _5, k4, b3, m5, M3, $2 = u4.props || p, x3 = r4.props, C3 = r4.type;
  if ("svg" == C3 ? f5 = "http://www.w3.org/2000/svg" : "math" == C3 ? f5 = "http://www.w3.org/1998/Math/MathML" : f5 || (f5 = "http://www.w3.org/1999/xhtml"), o5) {
    for (s4 = 0; s4 < o5.length; s4++) if ((k4 = o5[s4]) && (C3 ? k4.localName == C3 : 3 == k4.nodeType)) {
      t4 = k4, o5[s4] = null;
      break;
    }
  }
  if (!t4) {
    if (M3 = a5.ownerDocument || document, !C3) return M3.createTextNode(x3);
    t4 = M3.createElementNS(f5, C3, x3.is ? x3 : a5), l4 && (n.__m && n.__m(r4, o5), l4 = false), o5 = null;
  }
  if (C3) {
    if (a5 = "template" == C3 && t4.content || t4, o5 = "textarea" == C3 && null != x3.defaultValue ? null : o5 && d.call(a5.childNodes), !l4 && o5) for ($2 = {}, s4 = 0; s4 < t4.attributes.length; s4++) $2[(k4 = t4.attributes[s4]).name] = k4.value;
    for (s4 in $2) k4 = $2[s4], "dangerouslySetInnerHTML" == s4 ? y5 = k4 : "children" == s4 || s4 in x3 || "value" == s4 && "defaultValue" in x3 || "checked" == s4 && "defaultChecked" in x3 || N(t4, s4, null, k4, f5);
    for (s4 in x3) k4 = x3[s4], "children" == s4 ? _5 = k4 : "dangerouslySetInnerHTML" == s4 ? h5 = k4 : "value" == s4 ? b3 = k4 : "checked" == s4 ? m5 = k4 : l4 && "function" != typeof k4 || $2[s4] === k4 || N(t4, s4, k4, $2[s4], f5);
    h5 ? (l4 || y5 && (h5.__html == y5.__html || h5.__html == t4.innerHTML) || (t4.innerHTML = h5.__html), r4.__k = []) : (y5 && (t4.textContent = ""), ("foreignObject" == C3 || "http://www.w3.org/1998/Math/MathML" == f5 && v.test(C3)) && (f5 = "http://www.w3.org/1999/xhtml"), I(a5, w(_5) ? _5 : [_5], r4, u4, i4, f5, o5, e4, o5 ? o5[0] : u4.__k && S(u4, 0), l4, c4), o5 && o5.some(g)), l4 && "textarea" != C3 || (s4 = "value", "progress" == C3 && null == b3 ? t4.removeAttribute(s4) : null == b3 || b3 === t4[s4] && ("progress" != C3 || b3) || N(t4, s4, b3, $2[s4], f5), s4 = "checked", null != m5 && m5 != t4[s4] && N(t4, s4, m5, $2[s4], f5));
  } else $2 === x3 || l4 && t4.data == x3 || (t4.data = x3);
  return t4;
}
function G(t4, r4, u4, i4) {
  try {
    "function" == typeof t4 ? r4 ? r4.__x = t4(r4) || 1 : i4 && (i4 = i4.__c || i4.__e) && (r4 = i4.__x) && (i4.__x = null, "function" == typeof r4 ? r4() : t4(null)) : t4.current = r4;
  } catch (t5) {
    n.__e(t5, u4);
  }
}
function J(t4, r4, u4) {
  var i4, f5, o5, e4;
  if (n.unmount && n.unmount(t4), !(i4 = t4.ref) || i4.current && i4.current != t4.__e || G(i4, null, r4, t4), i4 = t4.__c) {
    if (i4.componentWillUnmount) try {
      i4.componentWillUnmount();
    } catch (t5) {
      n.__e(t5, r4);
    }
    i4.__P = i4.__n = null;
  }
  if (i4 = t4.__k) for (e4 = 0; e4 < i4.length; e4++) i4[e4] && J(i4[e4], r4, "function" != typeof t4.type || u4 && !t4.props.__P);
  !u4 && (i4 = t4.__c) && (i4 = i4.__z) && (f5 = B(i4, o5 = [])) && (i4 == t4.__e && o5.some(g), g(f5), g(i4)), u4 || g(t4.__e), t4.__e = t4.__c = t4.__ = null;
}
function K(n3, t4, r4) {
  return this.constructor(n3, r4);
}
function Q(t4, r4) {
  var u4, i4, f5, o5;
  n.__ && n.__(t4, r4), 9 == r4.nodeType && (r4 = r4.documentElement), i4 = (u4 = t4 && 32 & t4.__u) ? null : r4.__k, r4.__k = m($, { children: [t4] }), f5 = [], o5 = [], z(r4, r4.__k, i4 || p, p, r4.namespaceURI, i4 ? null : r4.firstChild ? d.call(r4.childNodes) : null, f5, i4 ? i4.__e : r4.firstChild, u4, o5), E(f5, r4.__k, o5), r4.__k.props.children = null;
}
n = { __e: function(n3, t4, r4, u4) {
  for (var i4, o5, e4; t4 = t4.__; ) if ((i4 = t4.__c) && !(1 & i4.__g)) {
    i4.__g |= 4;
    try {
      if ((e4 = (o5 = i4.constructor) && o5.getDerivedStateFromError) && i4.setState(o5.getDerivedStateFromError(n3)), i4.componentDidCatch && (i4.componentDidCatch(n3, u4 || {}), e4 = 1), e4 && 8 & i4.__g) return void (i4.__g |= 2);
    } catch (t5) {
      n3 = t5;
    }
  }
  throw f = 0, n3;
} }, t = 0, r = function(n3) {
  return null != n3 && n3.constructor === h;
}, x.prototype.setState = function(n3, t4) {
  var r4 = this.__s;
  r4 && r4 != this.state || (r4 = this.__s = _({}, this.state)), "function" == typeof n3 && (n3 = n3(_({}, r4), this.props)), n3 && (_(r4, n3), this.__v && (t4 && this.__k.push(t4), L(this)));
}, x.prototype.forceUpdate = function(n3) {
  this.__v && (this.__g |= 4, n3 && this.__h.push(n3), L(this));
}, x.prototype.render = $, u = [], f = 0, o = function(n3, t4) {
  return n3.__v.__b - t4.__v.__b;
}, e = /* @__PURE__ */ Symbol(), l = /(PointerCapture)$|Capture$/i, c = 0, a = {}, s = 0;

// node_modules/preact/hooks/dist/hooks.mjs
var t2;
var r2;
var u2;
var i2;
var o2 = Object.is;
var f2 = 0;
var c2 = [];
var e2 = [];
var a2 = n;
var v2 = a2.__b;
var l2 = a2.__r;
var m2 = a2.diffed;
var h2 = a2.__c;
var s2 = a2.unmount;
var p2 = a2.__;
function y2(n3, t4) {
  a2.__h && a2.__h(r2, n3, f2 || t4), f2 = 0;
  var u4 = r2.__H || (r2.__H = { __: [], __h: [] });
  return n3 >= u4.__.length && u4.__.push({}), u4.__[n3];
}
function d2(n3) {
  return f2 = 1, _2(G2, n3);
}
function _2(n3, u4, i4) {
  var f5 = y2(t2++, 2);
  if (f5.t = n3, !f5.__c && (f5.__ = [i4 ? i4(u4) : G2(void 0, u4), function(n4) {
    var t4 = (f5.__N || f5.__)[0], r4 = f5.t(t4, n4);
    o2(t4, r4) || (f5.__N = [r4, f5.__[1]], f5.__c.setState({}));
  }], f5.__c = r2, !r2.__f)) {
    r2.__f = true;
    var c4 = r2.shouldComponentUpdate;
    r2.shouldComponentUpdate = function(n4, t4, r4) {
      var u5 = this.__H;
      if (!u5) return true;
      var i5 = false, f6 = this.props != n4;
      if (u5.__.some(function(n5) {
        n5.__N && (i5 = true, o2(n5.__[0], n5.__N[0]) || (f6 = true));
      }), c4) {
        var e4 = c4.call(this, n4, t4, r4);
        return i5 ? e4 || f6 : e4;
      }
      return !i5 || f6;
    };
  }
  return f5.__;
}
function A2(n3, u4) {
  var i4 = y2(t2++, 3);
  !a2.__s && E2(i4.__H, u4) && (i4.__P = true, i4.__ = n3, i4.u = u4, r2.__H.__h.push(i4));
}
function F2(n3, u4) {
  var i4 = y2(t2++, 4);
  !a2.__s && E2(i4.__H, u4) && (i4.__P = false, i4.__ = n3, i4.u = u4, r2.__h.push(i4));
}
function T2(n3) {
  return f2 = 5, w2(function() {
    return { current: n3 };
  }, []);
}
function w2(n3, r4) {
  var u4 = y2(t2++, 7);
  return E2(u4.__H, r4) && (u4.__ = n3(), u4.__H = r4), u4.__;
}
function g2() {
  var n3;
  do {
    for (; n3 = e2.shift(); ) try {
      C2(n3);
    } catch (t5) {
      a2.__e(t5, { __: (n3 = n3.__P) && n3.__v });
    }
    for (; n3 = c2.shift(); ) {
      var t4 = n3.__H;
      if (n3.__P && t4) try {
        t4.__h.some(C2), t4.__h.some(D2), t4.__h = [];
      } catch (r4) {
        t4.__h = [], a2.__e(r4, n3.__v);
      }
    }
  } while (e2.length);
}
a2.__b = function(n3) {
  r2 = null, v2 && v2(n3);
}, a2.__ = function(n3, t4) {
  n3 && t4.__k && t4.__k.__m && (n3.__m = t4.__k.__m), p2 && p2(n3, t4);
}, a2.__r = function(n3) {
  l2 && l2(n3), t2 = 0;
  var i4 = (r2 = n3.__c).__H;
  i4 && (u2 == r2 ? r2.__h = [] : (i4.__h.some(C2), i4.__h.some(D2), t2 = 0), i4.__h = [], i4.__.some(function(n4) {
    n4.__N && (n4.__ = n4.__N), n4.u = n4.__N = void 0;
  })), u2 = r2;
}, a2.diffed = function(n3) {
  m2 && m2(n3);
  var t4 = n3.__c;
  t4 && t4.__H && (t4.__H.__h.length && B2(c2.push(t4)), t4.__H.__.some(function(n4) {
    n4.u && (n4.__H = n4.u);
  })), u2 = r2 = null;
}, a2.__c = function(n3, t4) {
  t4.some(function(n4) {
    try {
      n4.__h.some(C2), n4.__h = n4.__h.filter(function(n5) {
        return !n5.__ || D2(n5);
      });
    } catch (t5) {
      n4.__h = [function() {
        throw t5;
      }];
    }
  }), h2 && h2(n3, t4);
}, a2.unmount = function(n3) {
  s2 && s2(n3);
  var t4, r4, u4 = n3.__c;
  u4 && u4.__H && (u4.__H.__.some(function(u5) {
    try {
      if (u5.__P && u5.__c) {
        if (void 0 === r4) {
          for (r4 = n3.__; r4 && (!r4.__c || !r4.__c.__P); ) r4 = r4.__;
          r4 = r4 && r4.__c;
        }
        u5.__P = r4, B2(e2.push(u5));
      } else C2(u5);
    } catch (n4) {
      t4 = n4;
    }
  }), u4.__H = void 0, t4 && a2.__e(t4, u4.__v));
};
var k2 = "function" == typeof requestAnimationFrame;
function z2(n3) {
  var t4, r4 = function() {
    clearTimeout(u4), k2 && cancelAnimationFrame(t4), setTimeout(n3);
  }, u4 = setTimeout(r4, 35);
  k2 && (t4 = requestAnimationFrame(r4));
}
function B2(n3) {
  1 != n3 && i2 == a2.requestAnimationFrame || ((i2 = a2.requestAnimationFrame) || z2)(g2);
}
function C2(n3) {
  var t4 = r2, u4 = n3.__c;
  "function" == typeof u4 && (n3.__c = void 0, u4()), r2 = t4;
}
function D2(n3) {
  var t4 = r2;
  n3.__c = n3.__(), r2 = t4;
}
function E2(n3, t4) {
  return !n3 || n3.length != t4.length || t4.some(function(t5, r4) {
    return !o2(t5, n3[r4]);
  });
}
function G2(n3, t4) {
  return "function" == typeof t4 ? t4(n3) : t4;
}

// node_modules/@preact/signals-core/dist/signals-core.module.js
var i3 = /* @__PURE__ */ Symbol.for("preact-signals");
function t3() {
  if (!(v3 > 1)) {
    var i4, t4 = false;
    !(function() {
      var i5 = c3;
      c3 = void 0;
      while (void 0 !== i5) {
        var t5 = i5.S;
        if (t5.v === i5.v) {
          for (var r5 = t5.t; void 0 !== r5; r5 = r5.x) if (r5.i === i5.i) r5.i = t5.i;
        }
        i5 = i5.o;
      }
    })();
    while (void 0 !== h3) {
      var r4 = h3;
      h3 = void 0;
      s3++;
      while (void 0 !== r4) {
        var n3 = r4.u;
        r4.u = void 0;
        r4.f &= -3;
        if (!(8 & r4.f) && w3(r4)) try {
          r4.c();
        } catch (r5) {
          if (!t4) {
            i4 = r5;
            t4 = true;
          }
        }
        r4 = n3;
      }
    }
    s3 = 0;
    v3--;
    if (t4) throw i4;
  } else v3--;
}
function r3(i4) {
  if (v3 > 0) return i4();
  u3 = ++e3;
  v3++;
  try {
    return i4();
  } finally {
    t3();
  }
}
var n2;
var o3 = void 0;
function f3(i4) {
  var t4 = o3, r4 = n2;
  o3 = void 0;
  n2 = void 0;
  try {
    return i4();
  } finally {
    o3 = t4;
    n2 = r4;
  }
}
var h3 = void 0;
var v3 = 0;
var s3 = 0;
var e3 = 0;
var u3 = 0;
var c3 = void 0;
var a3 = 0;
function d3(i4) {
  if (void 0 !== o3) {
    var t4 = i4.n;
    if (void 0 === t4 || t4.t !== o3) {
      t4 = { i: 0, S: i4, p: o3.s, n: void 0, t: o3, e: void 0, x: void 0, r: t4 };
      if (void 0 !== o3.s) o3.s.n = t4;
      o3.s = t4;
      i4.n = t4;
      if (32 & o3.f) i4.S(t4);
      return t4;
    } else if (-1 === t4.i) {
      t4.i = 0;
      if (void 0 !== t4.n) {
        t4.n.p = t4.p;
        if (void 0 !== t4.p) t4.p.n = t4.n;
        t4.p = o3.s;
        t4.n = void 0;
        o3.s.n = t4;
        o3.s = t4;
      }
      return t4;
    }
  }
}
function l3(i4, t4) {
  this.v = i4;
  this.i = 0;
  this.n = void 0;
  this.t = void 0;
  this.l = 0;
  this.W = null == t4 ? void 0 : t4.watched;
  this.Z = null == t4 ? void 0 : t4.unwatched;
  this.name = null == t4 ? void 0 : t4.name;
}
l3.prototype.brand = i3;
l3.prototype.h = function() {
  return true;
};
l3.prototype.S = function(i4) {
  var t4 = this, r4 = this.t;
  if (r4 !== i4 && void 0 === i4.e) {
    i4.x = r4;
    this.t = i4;
    if (void 0 !== r4) r4.e = i4;
    else f3(function() {
      var i5;
      null == (i5 = t4.W) || i5.call(t4);
    });
  }
};
l3.prototype.U = function(i4) {
  var t4 = this;
  if (void 0 !== this.t) {
    var r4 = i4.e, n3 = i4.x;
    if (void 0 !== r4) {
      r4.x = n3;
      i4.e = void 0;
    }
    if (void 0 !== n3) {
      n3.e = r4;
      i4.x = void 0;
    }
    if (i4 === this.t) {
      this.t = n3;
      if (void 0 === n3) f3(function() {
        var i5;
        null == (i5 = t4.Z) || i5.call(t4);
      });
    }
  }
};
l3.prototype.subscribe = function(i4) {
  var t4 = this;
  return x2(function() {
    var r4 = t4.value;
    f3(function() {
      return i4(r4);
    });
  }, { name: "sub" });
};
l3.prototype.valueOf = function() {
  return this.value;
};
l3.prototype.toString = function() {
  return this.value + "";
};
l3.prototype.toJSON = function() {
  return this.value;
};
l3.prototype.peek = function() {
  var i4 = this;
  return f3(function() {
    return i4.value;
  });
};
Object.defineProperty(l3.prototype, "value", { get: function() {
  var i4 = d3(this);
  if (void 0 !== i4) i4.i = this.i;
  return this.v;
}, set: function(i4) {
  if (i4 !== this.v) {
    if (s3 > 100) throw new Error("Cycle detected");
    !(function(i5) {
      if (0 !== v3 && 0 === s3) {
        if (i5.l !== u3) {
          i5.l = u3;
          c3 = { S: i5, v: i5.v, i: i5.i, o: c3 };
        }
      }
    })(this);
    this.v = i4;
    this.i++;
    a3++;
    v3++;
    try {
      for (var r4 = this.t; void 0 !== r4; r4 = r4.x) r4.t.N();
    } finally {
      t3();
    }
  }
} });
function y3(i4, t4) {
  return new l3(i4, t4);
}
function w3(i4) {
  for (var t4 = i4.s; void 0 !== t4; t4 = t4.n) if (t4.S.i !== t4.i || !t4.S.h() || t4.S.i !== t4.i) return true;
  return false;
}
function b(i4) {
  for (var t4 = i4.s; void 0 !== t4; t4 = t4.n) {
    var r4 = t4.S.n;
    if (void 0 !== r4) t4.r = r4;
    t4.S.n = t4;
    t4.i = -1;
    if (void 0 === t4.n) {
      i4.s = t4;
      break;
    }
  }
}
function _3(i4) {
  var t4 = i4.s, r4 = void 0;
  while (void 0 !== t4) {
    var n3 = t4.p;
    if (-1 === t4.i) {
      t4.S.U(t4);
      if (void 0 !== n3) n3.n = t4.n;
      if (void 0 !== t4.n) t4.n.p = n3;
    } else r4 = t4;
    t4.S.n = t4.r;
    if (void 0 !== t4.r) t4.r = void 0;
    t4 = n3;
  }
  i4.s = r4;
}
function j2(i4, t4) {
  l3.call(this, void 0, t4);
  this.x = i4;
  this.s = void 0;
  this.g = a3 - 1;
  this.f = 4;
}
j2.prototype = new l3();
j2.prototype.h = function() {
  this.f &= -3;
  if (1 & this.f) return false;
  if (32 == (36 & this.f)) return true;
  this.f &= -5;
  if (this.g === a3) return true;
  this.g = a3;
  this.f |= 1;
  if (this.i > 0 && !w3(this)) {
    this.f &= -2;
    return true;
  }
  var i4 = o3;
  try {
    b(this);
    o3 = this;
    var t4 = this.x();
    if (16 & this.f || this.v !== t4 || 0 === this.i) {
      this.v = t4;
      this.f &= -17;
      this.i++;
    }
  } catch (i5) {
    this.v = i5;
    this.f |= 16;
    this.i++;
  }
  o3 = i4;
  _3(this);
  this.f &= -2;
  return true;
};
j2.prototype.S = function(i4) {
  if (void 0 === this.t) {
    this.f |= 36;
    for (var t4 = this.s; void 0 !== t4; t4 = t4.n) t4.S.S(t4);
  }
  l3.prototype.S.call(this, i4);
};
j2.prototype.U = function(i4) {
  if (void 0 !== this.t) {
    l3.prototype.U.call(this, i4);
    if (void 0 === this.t) {
      this.f &= -33;
      for (var t4 = this.s; void 0 !== t4; t4 = t4.n) t4.S.U(t4);
    }
  }
};
j2.prototype.N = function() {
  if (!(2 & this.f)) {
    this.f |= 6;
    for (var i4 = this.t; void 0 !== i4; i4 = i4.x) i4.t.N();
  }
};
Object.defineProperty(j2.prototype, "value", { get: function() {
  if (1 & this.f) throw new Error("Cycle detected");
  var i4 = d3(this);
  this.h();
  if (void 0 !== i4) i4.i = this.i;
  if (16 & this.f) throw this.v;
  return this.v;
} });
function O(i4, t4) {
  return new j2(i4, t4);
}
function p3(i4) {
  var r4 = i4.j;
  i4.j = void 0;
  if ("function" == typeof r4) {
    v3++;
    var n3 = o3;
    o3 = void 0;
    try {
      r4();
    } catch (t4) {
      i4.f &= -2;
      i4.f |= 8;
      g3(i4);
      throw t4;
    } finally {
      o3 = n3;
      t3();
    }
  }
}
function g3(i4) {
  for (var t4 = i4.s; void 0 !== t4; t4 = t4.n) t4.S.U(t4);
  i4.x = void 0;
  i4.s = void 0;
  p3(i4);
}
function S2(i4) {
  if (o3 !== this) throw new Error("Out-of-order effect");
  _3(this);
  o3 = i4;
  this.f &= -2;
  try {
    if (8 & this.f) g3(this);
  } finally {
    t3();
  }
}
function m3(i4, t4) {
  this.x = i4;
  this.j = void 0;
  this.s = void 0;
  this.u = void 0;
  this.f = 32;
  this.name = null == t4 ? void 0 : t4.name;
  if (n2) n2.push(this);
}
m3.prototype.c = function() {
  var i4 = this.S();
  try {
    if (8 & this.f) return;
    if (void 0 === this.x) return;
    var t4 = this.x();
    if ("function" == typeof t4) this.j = t4;
  } finally {
    i4();
  }
};
m3.prototype.S = function() {
  if (1 & this.f) throw new Error("Cycle detected");
  this.f |= 1;
  this.f &= -9;
  p3(this);
  b(this);
  v3++;
  var i4 = o3;
  o3 = this;
  return S2.bind(this, i4);
};
m3.prototype.N = function() {
  if (!(2 & this.f)) {
    this.f |= 2;
    this.u = h3;
    h3 = this;
  }
};
m3.prototype.d = function() {
  this.f |= 8;
  if (!(1 & this.f)) g3(this);
};
m3.prototype.dispose = function() {
  this.d();
};
function x2(i4, t4) {
  var r4 = new m3(i4, t4);
  try {
    r4.c();
  } catch (i5) {
    r4.d();
    throw i5;
  }
  var n3 = r4.d.bind(r4);
  n3[Symbol.dispose] = n3;
  return n3;
}

// node_modules/@preact/signals/dist/signals.module.js
var h4;
var d4;
var p4;
var m4 = "undefined" != typeof window && !!window.__PREACT_SIGNALS_DEVTOOLS__;
var g4 = [];
x2(function() {
  h4 = this.N;
})();
function b2(i4, n3) {
  n[i4] = n3.bind(null, n[i4] || function() {
  });
}
function y4(i4) {
  if (p4) {
    var n3 = p4;
    p4 = void 0;
    n3();
  }
  p4 = i4 && i4.S();
}
function w4(i4) {
  var n3 = this, r4 = i4.data, t4 = useSignal(r4);
  t4.name = "ReactiveDom";
  t4.value = r4;
  var e4 = w2(function() {
    var i5 = n3, r5 = n3.__v;
    while (r5 = r5.__) if (r5.__c) {
      r5.__c.__$f |= 4;
      break;
    }
    var o5 = O(function() {
      var i6 = t4.value.value;
      return 0 === i6 ? 0 : true === i6 ? "" : i6 || "";
    }), e5 = O(function() {
      return !Array.isArray(o5.value) && !r(o5.value);
    }), u5 = x2(function() {
      this.N = M;
      if (e5.value) {
        var n4 = o5.value;
        if (i5.__v && i5.__v.__e && 3 === i5.__v.__e.nodeType) i5.__v.__e.data = n4;
      }
    }), c5 = n3.__$u.d;
    n3.__$u.d = function() {
      u5();
      c5.call(this);
    };
    return [e5, o5];
  }, []), u4 = e4[0], c4 = e4[1];
  return u4.value ? c4.peek() : c4.value;
}
w4.displayName = "ReactiveTextNode";
Object.defineProperties(l3.prototype, { constructor: { configurable: true, value: k($, null).constructor }, type: { configurable: true, value: w4 }, props: { configurable: true, get: function() {
  var i4 = this;
  return { data: { get value() {
    return i4.value;
  } } };
} }, __b: { configurable: true, value: 1 } });
b2("__b", function(i4, n3) {
  y4();
  d4 = void 0;
  if ("string" == typeof n3.type) {
    var r4, t4 = n3.props;
    for (var f5 in t4) if ("children" !== f5) {
      var o5 = t4[f5];
      if (o5 instanceof l3) {
        if (!r4) n3.__np = r4 = {};
        r4[f5] = o5;
        t4[f5] = o5.peek();
      }
    }
  }
  i4(n3);
});
b2("__r", function(i4, r4) {
  i4(r4);
  if (r4.type !== $) {
    y4();
    var t4, f5 = r4.__c;
    if (f5) {
      f5.__$f &= -2;
      if (void 0 === (t4 = f5.__$u)) f5.__$u = t4 = (function(i5, n3) {
        var r5;
        x2(function() {
          r5 = this;
        }, { name: n3 });
        r5.c = i5;
        return r5;
      })(/* @__PURE__ */ (function(i5) {
        return function() {
          var n3;
          if (m4) null == (n3 = this.y) || n3.call(this);
          i5.__$f |= 1;
          i5.setState({});
        };
      })(f5), "function" == typeof r4.type ? r4.type.displayName || r4.type.name : "");
    }
    d4 = f5;
    y4(t4);
  }
});
b2("__e", function(i4, n3, r4, t4) {
  y4();
  d4 = void 0;
  i4(n3, r4, t4);
});
b2("diffed", function(i4, n3) {
  y4();
  d4 = void 0;
  var r4;
  if ("string" == typeof n3.type && (r4 = n3.__e)) {
    var t4 = n3.__np, f5 = n3.props, o5 = r4.U;
    if (o5) for (var e4 in o5) {
      var u4 = o5[e4];
      if (!(void 0 === u4 || t4 && e4 in t4)) {
        u4.d();
        o5[e4] = void 0;
      }
    }
    if (t4) {
      if (!o5) {
        o5 = {};
        r4.U = o5;
      }
      for (var a5 in t4) {
        var c4 = o5[a5], v4 = t4[a5];
        if (void 0 === c4) {
          c4 = k3(r4, a5, v4, f5);
          o5[a5] = c4;
        } else c4.o(v4, f5);
      }
    }
  }
  i4(n3);
});
function k3(i4, n3, r4, t4) {
  var f5 = n3 in i4 && void 0 === i4.ownerSVGElement, o5 = y3(r4);
  return { o: function(i5, n4) {
    o5.value = i5;
    t4 = n4;
  }, d: x2(function() {
    this.N = M;
    var r5 = o5.value.value;
    if (t4[n3] !== r5) {
      t4[n3] = r5;
      if (f5) i4[n3] = r5;
      else if (null != r5 && (false !== r5 || "-" === n3[4])) i4.setAttribute(n3, r5);
      else i4.removeAttribute(n3);
    }
  }) };
}
b2("unmount", function(i4, n3) {
  if ("string" == typeof n3.type) {
    var r4 = n3.__e;
    if (r4) {
      var t4 = r4.U;
      if (t4) {
        r4.U = void 0;
        for (var f5 in t4) {
          var o5 = t4[f5];
          if (o5) o5.d();
        }
      }
    }
    var e4 = n3.__np;
    if (e4) {
      var u4 = n3.props;
      for (var a5 in e4) u4[a5] = e4[a5];
    }
    n3.__np = void 0;
  } else {
    var c4 = n3.__c;
    if (c4) {
      c4.__$f |= 8;
      var v4 = c4.__$u;
      if (v4) {
        c4.__$u = void 0;
        v4.d();
      }
    }
  }
  i4(n3);
});
b2("__h", function(i4, n3, r4, t4) {
  if (t4 < 3) n3.__$f |= 2;
  i4(n3, r4, t4);
});
x.prototype.shouldComponentUpdate = function(i4, n3) {
  if (this.__R) return true;
  var r4 = this.__$u, t4 = r4 && void 0 !== r4.s;
  for (var f5 in n3) return true;
  if (this.__f || "boolean" == typeof this.u && true === this.u) {
    var o5 = 2 & this.__$f;
    if (!(t4 || o5 || 4 & this.__$f)) return true;
    if (1 & this.__$f) return true;
  } else {
    if (!(t4 || 4 & this.__$f)) return true;
    if (3 & this.__$f) return true;
  }
  for (var e4 in i4) if ("__source" !== e4 && i4[e4] !== this.props[e4]) return true;
  for (var u4 in this.props) if (!(u4 in i4)) return true;
  return false;
};
function useSignal(i4, n3) {
  return w2(function() {
    return y3(i4, n3);
  }, []);
}
var A3 = function(i4) {
  queueMicrotask(function() {
    queueMicrotask(i4);
  });
};
function F3() {
  r3(function() {
    var i4;
    while (i4 = g4.shift()) h4.call(i4);
  });
}
function M() {
  if (1 === g4.push(this)) (n.requestAnimationFrame || A3)(F3);
}

// src/core/arrangement.ts
var PANELS = ["tree", "map", "details", "time", "plots"];
var DOCKS = ["left", "right", "bottom"];
var HEIGHTS = [56, 2e3];
var WIDTHS = [120, 1200];
var within = (size, [least, most]) => Math.round(Math.max(least, Math.min(size, most)));
var usual = () => ({
  left: [{ name: "tree", size: null }],
  right: [
    { name: "map", size: 312 },
    { name: "details", size: null }
  ],
  bottom: [
    { name: "time", size: null },
    { name: "plots", size: null }
  ],
  widths: { left: 208, right: 416 }
});
function wordOf(all) {
  const dock = (name) => all[name].map((one) => one.size === null ? one.name : `${one.name}:${one.size}`).join(",");
  return [...DOCKS.map(dock), `${all.widths.left}:${all.widths.right}`].join("|");
}
function arrangementOf(word) {
  if (typeof word !== "string" || word.length > 200) return null;
  const parts = word.split("|");
  if (parts.length !== 4) return null;
  const all = { ...usual(), left: [], right: [], bottom: [] };
  const seen2 = /* @__PURE__ */ new Set();
  for (const [i4, dock] of DOCKS.entries())
    for (const text2 of parts[i4].split(",").filter(Boolean)) {
      const [, name, size] = /^([a-z]+)(?::(\d{1,4}))?$/.exec(text2) ?? [];
      const panel = PANELS.find((one) => one === name);
      if (!panel || seen2.has(panel)) return null;
      seen2.add(panel);
      all[dock].push({ name: panel, size: size ? within(Number(size), HEIGHTS) : null });
    }
  const [, left, right] = /^(\d{1,4}):(\d{1,4})$/.exec(parts[3]) ?? [];
  if (left === void 0) return null;
  return { ...all, widths: { left: within(Number(left), WIDTHS), right: within(Number(right), WIDTHS) } };
}
function placeOf(all, name) {
  for (const dock of DOCKS) {
    const index = all[dock].findIndex((one) => one.name === name);
    if (index >= 0) return { dock, index };
  }
  return null;
}
function moved(all, name, dock, index = Infinity) {
  const before = placeOf(all, name);
  const same2 = before !== null && before.dock === dock;
  const size = before && same2 ? all[before.dock][before.index].size : null;
  const next = { ...all };
  for (const one of DOCKS) next[one] = all[one].filter((panel) => panel.name !== name);
  if (dock === null) return next;
  const at = same2 && before.index < index ? index - 1 : index;
  next[dock] = [...next[dock].slice(0, at), { name, size }, ...next[dock].slice(at)];
  return next;
}
function resized(all, name, size) {
  const next = { ...all };
  for (const dock of DOCKS)
    next[dock] = all[dock].map((one) => one.name === name ? { name, size: within(size, HEIGHTS) } : one);
  return next;
}
var widened = (all, dock, width) => ({
  ...all,
  widths: { ...all.widths, [dock]: within(width, WIDTHS) }
});
function dropAt(at, docks, page2) {
  const inside2 = (box) => at.x >= box.x && at.x <= box.x + box.w && at.y >= box.y && at.y <= box.y + box.h;
  const over = docks.find((one) => inside2(one.box));
  const far = [
    ["left", at.x / page2.w],
    ["right", 1 - at.x / page2.w],
    ["bottom", 1 - at.y / page2.h]
  ];
  const dock = over?.dock ?? far.reduce((a5, b3) => b3[1] < a5[1] ? b3 : a5)[0];
  const panels2 = docks.find((one) => one.dock === dock)?.panels ?? [];
  const index = panels2.filter((box) => at.y > box.y + box.h / 2).length;
  return { dock, index };
}

// src/core/fold.ts
var RAISED = "exception";
var CUT_SHORT = "a new run began before it ended";
var NOT_RECORDED = "its end was not recorded";
var ENDED_GOALS = 20;
var NO_PREEMPT = { preempt: null, asked: null, serviced: null, abandoned: null };
var OF_VISIT = [
  "note",
  "question",
  "marking",
  "fired",
  "held",
  "resource"
];
var emptyState = () => ({
  run: 0,
  started: null,
  ended: null,
  outcome: null,
  states: {},
  goals: {},
  userdata: {}
});
var ms = (ns) => ns == null ? null : ns / 1e6;
var own = (map, key) => map && Object.hasOwn(map, key) ? map[key] : void 0;
function put(map, key, value) {
  if (key !== "__proto__") map[key] = value;
  else Object.defineProperty(map, key, { value, writable: true, enumerable: true, configurable: true });
  return value;
}
var requestOf = ({ source, by, why, grace }) => ({
  source: source ?? null,
  by: by ?? null,
  why: why ?? null,
  grace: grace ?? null
});
function foldOne(data, e4) {
  if (e4.dropped) data.dropped = (data.dropped ?? 0) + e4.dropped;
  const rule = own(RULES, e4.kind);
  rule?.(data, e4);
}
var RULES = {
  Started(data, e4) {
    data.run += 1;
    Object.assign(data, { started: e4.stamp_ns, ended: null, outcome: null });
    delete data.outages;
    const below = `${e4.path}/`;
    for (const [path, state] of Object.entries(data.states))
      if (path === e4.path || path.startsWith(below)) Object.assign(state, { since: null, waits: null, ...NO_PREEMPT });
    for (const goal of Object.values(data.goals))
      if (goal.ended == null && goal.path.startsWith(below))
        Object.assign(goal, { status: "LOST", text: CUT_SHORT, ended: e4.stamp_ns });
    enter(data, e4);
  },
  Recovered(data, e4) {
    if (data.started == null) Object.assign(data, { run: data.run + 1, started: e4.began_ns });
    Object.assign(data, {
      ended: null,
      outcome: null,
      outages: e4.outages.map((pair) => [...pair])
    });
    const active = new Map(e4.active);
    for (const [path, state] of Object.entries(data.states))
      if (state.since != null && !active.has(path))
        Object.assign(state, { since: null, left: e4.stamp_ns, waits: null, ...NO_PREEMPT });
    for (const [path, since] of active) {
      const state = stateOf(data, path);
      if (state.since == null && (state.left ?? -1) >= since) reopen(state, since);
      else if (state.since == null) Object.assign(state, { visits: state.visits + 1, attempt: 1 });
      Object.assign(state, { since: state.since ?? since, waits: null, error: null, ...NO_PREEMPT });
    }
    for (const goal of Object.values(data.goals))
      if (goal.ended == null && !active.has(goal.path))
        Object.assign(goal, { status: "LOST", text: NOT_RECORDED, ended: e4.stamp_ns });
  },
  Finished(data, e4) {
    const outcome = e4.outcome || RAISED;
    leave(data, e4, outcome);
    Object.assign(data, { ended: e4.stamp_ns, outcome });
  },
  Entered: enter,
  Left: (data, e4) => leave(data, e4, e4.outcome),
  Failed(data, e4) {
    leave(data, e4, RAISED);
    stateOf(data, e4.path).error = e4.error;
  },
  PreemptRequested(data, e4) {
    const state = stateOf(data, e4.path);
    if (state.since == null || state.preempt) return;
    Object.assign(state, { preempt: e4.stamp_ns, asked: requestOf(e4) });
  },
  PreemptServiced: (data, e4) => answerPreempt(data, e4, "serviced"),
  Abandoned: (data, e4) => answerPreempt(data, e4, "abandoned"),
  Retried(data, e4) {
    stateOf(data, e4.path).attempt = e4.attempt + 1;
  },
  Fired(data, e4) {
    const state = stateOf(data, e4.path);
    Object.assign(state, { marking: [...e4.marking], fired: e4.transition });
    delete state.held;
  },
  HeldBack(data, e4) {
    const held = {};
    for (const [i4, transition] of e4.transitions.entries())
      put(held, transition, e4.truths?.[i4] || `${e4.guards[i4]} is false`);
    stateOf(data, e4.path).held = held;
  },
  Iterated(data, e4) {
    stateOf(data, e4.path).item = e4.number;
  },
  ResourceUse(data, e4) {
    const state = stateOf(data, e4.path);
    if (e4.status === "free") delete state.resource;
    else state.resource = resourceText(e4);
  },
  Noted(data, e4) {
    stateOf(data, e4.path).note = e4.text;
  },
  Paused(data, e4) {
    stateOf(data, e4.path).waits = e4.reason;
  },
  Resumed(data, e4) {
    stateOf(data, e4.path).waits = null;
  },
  QuestionAsked(data, e4) {
    const { text: text2, answers, words: words2, default: otherwise, patience, service, has_picture } = e4;
    stateOf(data, e4.path).question = {
      ...{ text: text2, answers, words: words2, default: otherwise, patience, service, has_picture },
      ...{ asked: e4.stamp_ns, answer: null, by: null, answered: null }
    };
  },
  QuestionAnswered(data, e4) {
    const { question } = stateOf(data, e4.path);
    if (question) Object.assign(question, { answer: e4.answer, by: e4.by, answered: e4.stamp_ns });
  },
  UserdataWritten(data, e4) {
    const container = containerOf(e4.path);
    put(data.userdata, `${container} ${e4.key}`, {
      key: e4.key,
      value: e4.value,
      writer: e4.path,
      at: e4.stamp_ns,
      container
    });
  },
  GoalSent(data, e4) {
    put(data.goals, e4.goal_id, {
      path: e4.path,
      action: e4.action,
      since: e4.stamp_ns,
      goal: e4.goal,
      feedback: null,
      first_feedback: null,
      status: "ACTIVE",
      text: "",
      result: null,
      ended: null,
      attempt: stateOf(data, e4.path).attempt ?? 1
    });
    const ended = Object.entries(data.goals).filter(([, goal]) => goal.ended != null);
    ended.sort(([a5, one], [b3, other]) => one.since - other.since || (a5 < b3 ? -1 : 1));
    for (const [id] of ended.slice(0, Math.max(0, ended.length - ENDED_GOALS))) delete data.goals[id];
  },
  GoalFeedback(data, e4) {
    const goal = own(data.goals, e4.goal_id);
    if (!goal) return;
    goal.feedback = e4.feedback;
    goal.first_feedback ??= e4.feedback;
    if (e4.progress) goal.progress = e4.progress;
  },
  GoalDone(data, e4) {
    const goal = own(data.goals, e4.goal_id);
    if (goal) Object.assign(goal, { status: e4.status, text: e4.text, result: e4.result, ended: e4.stamp_ns });
  }
};
var containerOf = (path) => path.slice(0, Math.max(0, path.lastIndexOf("/"))) || path;
function resourceText({ status, resource, holder }) {
  const words2 = own({ waits: "waits for", holds: "holds", refused: "is refused" }, status) ?? "frees";
  return `${words2} ${resource}${holder ? `, held by ${holder}` : ""}`;
}
function stateOf(data, path) {
  const known2 = own(data.states, path);
  return known2 ?? put(data.states, path, { visits: 0, since: null, outcome: null, outcomes: {}, seconds: 0 });
}
function enter(data, e4) {
  const state = stateOf(data, e4.path);
  state.visits += 1;
  for (const fact of OF_VISIT) delete state[fact];
  Object.assign(state, { since: e4.stamp_ns, waits: null, error: null, attempt: 1, ...NO_PREEMPT });
}
function leave(data, e4, outcome) {
  const state = stateOf(data, e4.path);
  delete state.held;
  delete state.resource;
  if (state.since != null) state.seconds += (e4.stamp_ns - state.since) / 1e9;
  Object.assign(state, { since: null, left: e4.stamp_ns, outcome, waits: null, ...NO_PREEMPT });
  put(state.outcomes, outcome, (own(state.outcomes, outcome) ?? 0) + 1);
}
function reopen(state, since) {
  state.seconds = Math.max(0, state.seconds - ((state.left ?? since) - since) / 1e9);
  const { outcome, outcomes } = state;
  if (outcome !== null && outcomes[outcome] > 1) outcomes[outcome] -= 1;
  else if (outcome !== null) delete outcomes[outcome];
  state.outcome = Object.keys(outcomes).at(-1) ?? null;
}
function answerPreempt(data, e4, fact) {
  const state = stateOf(data, e4.path);
  if (state.preempt) state[fact] = e4.stamp_ns;
}

// src/core/text.ts
var SPACE = /[\t-\r\u0085\p{Z}]+/u;
var UNPRINTABLE = /[\p{C}\p{Z}]/gu;
function shorten(text2, length = 34) {
  const start = [...String(text2).slice(0, 8 * length)].slice(0, 4 * length).join("");
  const words2 = start.split(SPACE).filter(Boolean);
  const line = [...words2.map((word) => word.replace(UNPRINTABLE, "�")).join(" ")];
  return line.length <= length ? line.join("") : `${line.slice(0, length - 1).join("")}…`;
}
function shortenLines(text2, length) {
  const lines = [];
  let left = length;
  for (const line of text2.trim().split(/\r?\n/)) {
    if (left <= 0) return [...lines, "…"].join("\n");
    lines.push(shorten(line, left));
    left -= line.length + 1;
  }
  return lines.join("\n");
}
function duration(seconds) {
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 120) return `${Math.floor(seconds)} s`;
  const two = (n3) => String(Math.floor(n3)).padStart(2, "0");
  if (seconds < 7200) return `${Math.floor(seconds / 60)} min ${two(seconds % 60)}`;
  return `${Math.floor(seconds / 3600)} h ${two(seconds % 3600 / 60)}`;
}
var countOfEvents = (count) => `${count.toLocaleString("en")} event${count === 1 ? "" : "s"}`;
var SOURCES = {
  signal: "signal",
  shutdown: "the program's end",
  operator: "operator",
  timeout: "timeout of",
  concurrence: "concurrence, after",
  plan: "plan",
  action: "action",
  state: "state",
  test: "test",
  program: "program"
};
function askerText(asked2) {
  if (!asked2?.source) return null;
  const who = `${own(SOURCES, asked2.source) ?? asked2.source} ${asked2.by ?? ""}`.trim();
  return asked2.why ? `${who}: ${asked2.why}` : who;
}
function holdText(row, now) {
  const grace = row.asked?.grace;
  const limit = grace != null ? ` of ${duration(grace)}` : "";
  return `${duration((now - row.preempt) / 1e3)}${limit}${row.serviced !== null ? ", cleaning up" : ""}`;
}
function endOfPath(path, paths) {
  const parts = path.split("/");
  const ends = (one, end) => `/${one}`.endsWith(`/${end}`);
  for (let count = 1; count < parts.length; count++) {
    const end = parts.slice(-count).join("/");
    if (end && paths.filter((one) => ends(one, end)).length < 2) return end;
  }
  return path;
}
var lastWord = (path) => path.split("/").at(-1) || path;

// src/core/model.ts
var CHANGE_SIGNS = {
  added: "+",
  removed: "−",
  changed: "≠",
  numbers: "×"
};
var signed = (change3, name) => change3 ? `${CHANGE_SIGNS[change3]} ${name}` : name;
var KIND_NAMES = {
  state: "state",
  callback: "function",
  action: "action",
  service: "service call",
  monitor: "monitor",
  condition: "condition",
  machine: "state machine",
  sequence: "sequence",
  concurrence: "concurrence",
  iterator: "iterator",
  plan: "Petri net plan",
  place: "place",
  "goal place": "goal",
  "fail place": "failed plan",
  transition: "transition",
  missing: "missing state"
};
var isPartOfNet = ({ kind }) => kind === "transition" || kind.endsWith("place");
var isCleanup = (node) => node.details.some(([name, value]) => name === "runs" && value === "at any end");
function isInCleanup(node) {
  return Boolean(node && (isCleanup(node) || isInCleanup(node.parent)));
}
var MANY = 7;
var READABLE = 40;
var Model = class {
  payload;
  keys;
  root;
  byPath = /* @__PURE__ */ new Map();
  order = [];
  // parents first
  /** @param implicit whether to show implicit transitions */
  constructor(payload, implicit) {
    this.payload = payload;
    this.keys = payload.keys;
    this.root = implicit ? payload.implicit : payload.explicit;
    this.#index(this.root, null, 0);
    const counts = /* @__PURE__ */ new Map();
    for (const { name } of this.order) counts.set(name, (counts.get(name) ?? 0) + 1);
    for (const node of this.order) node.isRepeated = counts.get(node.name) > 1;
  }
  #index(node, parent, depth) {
    Object.assign(node, { parent, depth, number: this.order.length });
    node.name = shorten(node.caption || node.label);
    node.shown = signed(node.change, node.name);
    this.byPath.set(node.path, node);
    this.order.push(node);
    node.total = 1;
    for (const child of node.children) {
      this.#index(child, node, depth + 1);
      node.total += child.total;
    }
    node.joins = joinsOf(node);
    node.links = linksOf(node);
    const wired = /* @__PURE__ */ new Map();
    for (const link2 of node.links)
      for (const outcome of link2.outcomes) wired.set(link2.source, (wired.get(link2.source) ?? /* @__PURE__ */ new Set()).add(outcome));
    for (const child of node.children) child.wired = child.outcomes.filter((o5) => wired.get(child.label)?.has(o5));
  }
  get(path) {
    return path == null ? void 0 : this.byPath.get(path);
  }
  /** The containers around a state, outermost first. */
  ancestors(path) {
    const found = [];
    for (let node = this.get(path)?.parent; node; node = node.parent) found.unshift(node);
    return found;
  }
  /** The arrow of an outcome of a state. */
  linkOf(node, outcome) {
    return node.parent?.links.find((link2) => link2.source === node.label && link2.outcomes.includes(outcome));
  }
  search(text2) {
    const words2 = text2.toLowerCase().split(/\s+/).filter(Boolean);
    if (!words2.length) return [];
    const found = this.order.filter((node) => words2.every((word) => node.path.toLowerCase().includes(word)));
    const rank = (node) => node.label.toLowerCase().startsWith(words2[0]) ? 0 : 1;
    return found.sort((a5, b3) => rank(a5) - rank(b3) || a5.number - b3.number);
  }
  /** Paths of the containers down to `depth` levels, or of all; up to there many branches of one stay closed. */
  toDepth(depth) {
    const isWanted = (node) => node.children.length > 0 && node.depth < depth && (depth >= ALL_LEVELS || !this.isBranch(node));
    return new Set(this.order.filter(isWanted).map((node) => node.path));
  }
  /** Whether a state is one of many branches, or within one. */
  isBranch(node) {
    for (let one = node; one.parent; one = one.parent) if (hasManyBranches(one.parent)) return true;
    return false;
  }
  /** The greatest depth at which a page is readable at a glance. */
  readableDepth(most = READABLE, from = this.root) {
    let visible = 0;
    let depth = 0;
    let level = [from];
    while (level.length) {
      visible += level.length;
      if (visible > most && depth > 1) break;
      depth += 1;
      level = level.flatMap((node) => hasManyBranches(node) ? [] : node.children);
    }
    return Math.max(depth - 1, 1);
  }
};
var ALL_LEVELS = 99;
var hasManyBranches = ({ kind, children }) => kind === "concurrence" && children.length >= MANY;
function joinsOf(node) {
  const labels = new Set(node.children.map((child) => child.label));
  return node.rules.flatMap(({ outcome, conditions, text: text2, change: change3 }) => {
    const known2 = conditions.filter(([label]) => labels.has(label));
    if (new Set(known2.map(([label]) => label)).size < 2 || text2.startsWith("any of")) return [];
    const quorum = /^(\d+) of /.exec(text2);
    return [{ outcome, text: text2, change: change3, conditions: known2, need: quorum ? Number(quorum[1]) : known2.length }];
  });
}
function joinText({ need, conditions }, met) {
  const all = conditions.length;
  const what = need < all ? `${need} of ${all}` : all === 2 ? "both" : `all ${all}`;
  return met > 0 && met < need ? `${what}: ${met} of ${need}` : what;
}
function linksOf(node) {
  const found = node.edges.map((edge) => ({ ...edge, rule: null, join: null }));
  const keyOf3 = (...parts) => parts.join("\n");
  const known2 = new Set(found.flatMap((edge) => edge.outcomes.map((o5) => keyOf3(edge.source, o5, edge.target, null))));
  for (const rule of node.rules) {
    const number = node.joins.findIndex((one) => one.outcome === rule.outcome && one.text === rule.text);
    const join2 = number < 0 ? null : number;
    for (const [source, outcome] of rule.conditions) {
      const key = keyOf3(source, outcome, rule.outcome, join2);
      if (known2.has(key) || !node.children.some((child) => child.label === source)) continue;
      known2.add(key);
      const same2 = found.find(
        (edge) => edge.rule && edge.source === source && edge.target === rule.outcome && edge.change === rule.change && edge.join === join2
      );
      if (same2) same2.outcomes = [...same2.outcomes, outcome];
      else
        found.push({
          source,
          target: rule.outcome,
          to_outcome: true,
          outcomes: [outcome],
          implicit: false,
          back: false,
          rule: rule.text || rule.outcome,
          join: join2,
          change: rule.change,
          note: ""
        });
    }
  }
  return found;
}

// src/core/values.ts
var MOST = 2e4;
var ROUNDED = 6;
var WIDE = 88;
var QUOTED = /[\\\p{Cc}\u00a0\u2028\u2029]/gu;
var ESCAPES = { "\\": "\\\\", "\n": "\\n", "\r": "\\r", "	": "\\t" };
function quoted(text2) {
  const quote = text2.includes("'") && !text2.includes('"') ? '"' : "'";
  const hex = (c4) => c4.charCodeAt(0).toString(16);
  const inside2 = text2.replace(QUOTED, (c4) => {
    const long = c4.charCodeAt(0) > 255;
    return ESCAPES[c4] ?? (long ? `\\u${hex(c4)}` : `\\x${hex(c4).padStart(2, "0")}`);
  });
  return `${quote}${quote === "'" ? inside2.replaceAll("'", "\\'") : inside2}${quote}`;
}
var isTree = (value) => typeof value === "object" && value !== null && !Array.isArray(value);
var items = (value) => {
  if (!Array.isArray(value)) throw new TypeError("no list");
  return value;
};
var className = (value) => String(value.$object ?? String(value.$msg).split("/").at(-1));
function fieldsOf(value) {
  if (!isTree(value)) return null;
  if ("$msg" in value || "$object" in value) return isTree(value.fields) ? value.fields : {};
  return formOf(value) === null ? value : null;
}
var FORMS = {
  $tuple: ({ $tuple }) => listed("tuple", "(", items($tuple), items($tuple).length === 1 ? ",)" : ")"),
  $set: ({ $set }) => items($set).length ? listed("set", "{", items($set), "}") : "set()",
  $items: ({ $items }) => ({
    ...{ name: "dict", begin: "{", end: "}", sign: ": " },
    parts: items($items).map((item) => [brief(items(item)[0]), items(item)[1]])
  }),
  $float: ({ $float }) => String($float),
  $int: ({ $int }) => String($int),
  $bytes: ({ $bytes }) => `b${quoted(atob(String($bytes)))}`,
  $msg: (value) => called(value),
  $object: (value) => called(value),
  $array: ({ $array, dtype }) => listed("array", "array([", items($array), `], dtype=${dtype})`),
  $cut: ({ $cut }) => `${quoted(String($cut))}…`,
  $large: ({ $large, length }) => `<${$large} of ${length} elements>`,
  $repr: ({ $repr }) => String($repr)
};
var listed = (name, begin, parts, end) => ({
  name,
  begin,
  end,
  sign: "",
  parts: parts.map((one) => [null, one])
});
var called = (value) => ({
  ...{ name: className(value), begin: `${className(value)}(`, end: ")", sign: "=" },
  parts: Object.entries(fieldsOf(value) ?? {})
});
var formOf = (value) => Object.keys(FORMS).find((mark) => Object.hasOwn(value, mark)) ?? null;
function opened(value, numberText2) {
  if (value === null || value === void 0) return "None";
  if (typeof value === "boolean") return value ? "True" : "False";
  if (typeof value === "number") return numberText2(value);
  if (typeof value === "string") return quoted(value);
  if (Array.isArray(value)) return listed("list", "[", value, "]");
  if (!isTree(value)) return String(value);
  const form = formOf(value);
  try {
    if (form) return FORMS[form](value);
  } catch {
  }
  const parts = Object.entries(value).map(([key, part]) => [quoted(key), part]);
  return { name: "dict", begin: "{", end: "}", sign: ": ", parts };
}
var rounded = (number) => String(Number.isInteger(number) ? number : Number(number.toPrecision(ROUNDED)));
var branchOf = (value) => opened(value, rounded);
var brief = (value) => text(value, rounded);
function text(value, numberText2) {
  const one = opened(value, numberText2);
  if (typeof one === "string") return one;
  const parts = one.parts.map(([name, part]) => `${head(one, name)}${text(part, numberText2)}`);
  return `${one.begin}${parts.join(", ")}${one.end}`;
}
var head = ({ sign: sign2 }, name) => name === null ? "" : `${name}${sign2}`;
var pretty = (value) => wrapped(value, "").slice(0, MOST);
function wrapped(value, indent) {
  const line = text(value, String);
  const one = opened(value, String);
  if (typeof one === "string" || line.length + indent.length <= WIDE) return line;
  const inner = `${indent}  `;
  const parts = one.parts.map(([name, part]) => `${inner}${head(one, name)}${wrapped(part, inner)}`);
  return `${one.begin}
${parts.join(",\n")}
${indent}${one.end}`;
}
function wasShortened(value) {
  if (Array.isArray(value)) return value.some(wasShortened);
  if (!isTree(value)) return false;
  if ("$cut" in value || "$large" in value || String(value.$repr ?? "").endsWith("…")) return true;
  return Object.values(value).some(wasShortened);
}

// src/core/places.ts
var LONGEST_NAME = 40;
var MOST_NAMES = 200;
var fields = (value) => fieldsOf(value) ?? {};
var isNumber = (value) => Number.isFinite(value);
function placeOf2(stamped) {
  const outer = fields(stamped);
  const { position, orientation } = fields(outer.pose ?? stamped);
  const { x: x3, y: y5 } = fields(position);
  if (!isNumber(x3) || !isNumber(y5)) return null;
  const turn = fields(orientation);
  const [qx, qy, qz, qw] = [turn.x, turn.y, turn.z, turn.w].map((v4) => isNumber(v4) ? v4 : 0);
  const frame = fields(outer.header).frame_id ?? "map";
  const yaw = Math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz));
  return /(^|\/)map$/.test(String(frame)) ? { x: x3, y: y5, yaw } : null;
}
var placeIn = (message, names) => names.map((name) => placeOf2(own(fields(message), name))).find((place) => place !== null) ?? null;
function namedPlaces(value) {
  const one = namedPlace(value, null);
  if (one) return [one];
  const parts = isTree(value) ? value.$tuple : value;
  const named = Array.isArray(parts) ? parts.slice(0, MOST_NAMES).map((part) => namedPlace(part, null)) : Object.entries(fields(value)).slice(0, MOST_NAMES).map(([key, part]) => namedPlace(part, key));
  return named.filter((place) => place !== null);
}
function namedPlace(value, key) {
  const { name, label, x: x3, y: y5, pose } = fields(value);
  const called2 = name ?? label ?? key;
  if (typeof called2 !== "string" || !called2 || called2.length > LONGEST_NAME) return null;
  const place = isNumber(x3) && isNumber(y5) ? { x: x3, y: y5 } : placeOf2(pose ?? value) ?? fields(pose);
  return isNumber(place.x) && isNumber(place.y) ? { name: called2, x: place.x, y: place.y } : null;
}
var placeText = ({ x: x3, y: y5 }) => `(${x3.toFixed(1)}, ${y5.toFixed(1)})`;

// src/core/idle.ts
var LEAST_MS = 3e5;
var PART = 20;
var WIDTH = 44;
var MOST2 = 1 / 3;
function idleIn(events) {
  const long = [];
  for (let i4 = 1; i4 < events.length; i4++) {
    const [from, to] = [events[i4 - 1].stamp_ns / 1e6, events[i4].stamp_ns / 1e6];
    if (to - from >= LEAST_MS) long.push({ from, to });
  }
  long.sort((a5, b3) => lengthOf(b3) - lengthOf(a5));
  let rest = events.length ? (events[events.length - 1].stamp_ns - events[0].stamp_ns) / 1e6 : 0;
  const found = [];
  for (const one of long) {
    if (lengthOf(one) * PART < rest) break;
    rest -= lengthOf(one);
    found.push(one);
  }
  return found.sort((a5, b3) => a5.from - b3.from);
}
var lengthOf = ({ from, to }) => to - from;
var Axis = class {
  from;
  // [ms]
  to;
  left;
  // [px]
  right;
  folds;
  // those in the range
  rate;
  // [px/ms], but for folded times
  #width = 0;
  // of a folded time [px]
  /** @param folds do not overlap, in their order */
  constructor(folds, { from, to }, left, right) {
    [this.from, this.to, this.left, this.right] = [from, to, left, right];
    this.folds = folds.filter((one) => one.from < to && one.to > from && !(one.from <= from && one.to >= to));
    const inside2 = this.folds.map((one) => Math.min(one.to, to) - Math.max(one.from, from));
    const parts = this.folds.reduce((sum, one, i4) => sum + inside2[i4] / lengthOf(one), 0);
    const busy = to - from - inside2.reduce((a5, b3) => a5 + b3, 0);
    if (parts) this.#width = Math.min(WIDTH, (right - left) * MOST2 / parts);
    this.rate = (right - left - parts * this.#width) / Math.max(busy, 1e-6);
  }
  /** The place of an instant; outside of the range, too. */
  x(t4) {
    let busy = t4 - this.from;
    let parts = 0;
    for (const fold of this.folds) {
      const folded = Math.min(Math.max(t4, fold.from), fold.to) - Math.min(Math.max(this.from, fold.from), fold.to);
      busy -= folded;
      parts += folded / lengthOf(fold);
    }
    return this.left + busy * this.rate + parts * this.#width;
  }
  /** The instant at a place; outside of the range, too. */
  timeAt(px) {
    let [t4, at] = [this.from, this.left];
    for (const { from, to } of this.folds) {
      const [begin, end] = [this.x(from), this.x(to)];
      if (px < begin) return from - (begin - px) / this.rate;
      if (px <= end) return from + (px - begin) / (end - begin) * (to - from);
      [t4, at] = [to, end];
    }
    return t4 + (px - at) / this.rate;
  }
  /** The folded time at a place; null for none. */
  foldAt(px) {
    return this.folds.find(({ from, to }) => px >= this.x(from) && px <= this.x(to)) ?? null;
  }
};

// src/core/storage.ts
function saved(name, fallback) {
  try {
    return JSON.parse(localStorage.getItem(`smachpy.${name}`) ?? "null") ?? fallback;
  } catch {
    return fallback;
  }
}
function save(name, value) {
  try {
    localStorage.setItem(`smachpy.${name}`, JSON.stringify(value));
  } catch {
  }
}

// src/core/store/clock.ts
var CLOCKS = ["run", "wall", "relative"];
var Clock = class {
  chosen = y3(saved("clock", "run"));
  /** Whether idle times are folded; those that the user unfolded are not, by their beginnings [ms]. */
  foldsIdle = y3(true);
  unfolded = y3(/* @__PURE__ */ new Set());
  #idle = { key: "", found: [] };
  #data;
  #playback;
  constructor(data, playback) {
    this.#data = data;
    this.#playback = playback;
  }
  choose(name) {
    this.chosen.value = name;
    save("clock", name);
    this.#playback.updateSlow();
  }
  /** The idle times of the run. */
  idle() {
    const { events } = this.#data.run;
    const key = `${this.#data.facts.value?.epoch} ${events[0]?.seq} ${events.at(-1)?.seq}`;
    if (key !== this.#idle.key) this.#idle = { key, found: idleIn(events) };
    return this.#idle.found;
  }
  /** Those that are folded. */
  folds() {
    return this.foldsIdle.value ? this.idle().filter(({ from }) => !this.unfolded.value.has(from)) : [];
  }
  /** Fold all idle times, or none. */
  foldIdle(folds) {
    this.unfolded.value = /* @__PURE__ */ new Set();
    this.foldsIdle.value = folds;
  }
  unfold({ from }) {
    this.unfolded.value = /* @__PURE__ */ new Set([...this.unfolded.value, from]);
  }
  /** An instant by the chosen clock: 00:32.0 since the run began, 10:42:59 of the day, or -12.3 s from now. */
  instantText(t4, digits = 1) {
    if (this.chosen.value === "wall") return wallText(t4, digits);
    if (this.chosen.value !== "relative") return this.runText(t4, digits);
    const live = this.#data.liveMs();
    const seconds = (t4 - live) / 1e3;
    return Math.abs(seconds) < 60 ? `${seconds.toFixed(digits)} s` : this.runText(t4, digits, live);
  }
  /** An instant as time since another one, by default the beginning of the run, such as 00:32.0. */
  runText(t4, digits = 1, since = this.#playback.began() ?? t4) {
    const seconds = (t4 - since) / 1e3;
    const unit = 10 ** digits;
    const all = Math.round(Math.abs(seconds) * unit);
    const two = (n3) => String(Math.floor(n3)).padStart(2, "0");
    const hours = Math.floor(all / (3600 * unit));
    const part = digits ? `.${String(all % unit).padStart(digits, "0")}` : "";
    const minutes = `${two(all / unit / 60 % 60)}:${two(all / unit % 60)}${part}`;
    return `${seconds < 0 && all ? "-" : ""}${hours ? `${hours}:` : ""}${minutes}`;
  }
};
function wallText(t4, digits) {
  const unit = 10 ** digits;
  const rounded2 = new Date(Math.round(t4 * unit / 1e3) * (1e3 / unit));
  const part = digits ? `.${String(Math.round(rounded2.getMilliseconds() * (unit / 1e3))).padStart(digits, "0")}` : "";
  return `${rounded2.toLocaleTimeString("en-GB", { hour12: false })}${part}`;
}

// src/core/lists.ts
function countWhile(list, holds) {
  let low = 0;
  let high = list.length;
  while (low < high) {
    const mid = low + high >> 1;
    if (holds(list[mid])) low = mid + 1;
    else high = mid;
  }
  return low;
}
var parentOf = (path) => path.slice(0, Math.max(0, path.lastIndexOf("/")));
function innermost(list, pathOf2) {
  const above = /* @__PURE__ */ new Set();
  for (const entry of list) {
    for (let path = parentOf(pathOf2(entry)); path && !above.has(path); path = parentOf(path)) above.add(path);
  }
  return list.filter((one) => !above.has(pathOf2(one)));
}

// src/core/outcomes.ts
var words = (text2) => text2.split(" ");
var SUCCESS = words(
  "succeeded success successful done ok yes true valid complete completed finished reached arrived goal"
);
var FAILURE = words(
  "abort aborted fail failed failure error exception invalid no false timeout timed_out lost rejected denied impossible unreachable unreached"
);
var PREEMPTED_PREFIXES = words("preempt cancel recall interrupt");
var known = /* @__PURE__ */ new Map();
var MOST_KNOWN = 2e3;
function outcomeClass(outcome) {
  const before = known.get(outcome);
  if (before) return before;
  const found = classOf(outcome);
  if (known.size < MOST_KNOWN) known.set(outcome, found);
  return found;
}
function classOf(outcome) {
  const word = String(outcome).toLowerCase().replace(/[- ]/g, "_");
  if (SUCCESS.includes(word)) return "success";
  if (FAILURE.includes(word)) return "failure";
  return PREEMPTED_PREFIXES.some((start) => word.startsWith(start)) ? "preempted" : "other";
}
var WATCHING = ["monitor", "condition"];
var FINDINGS = ["invalid", "false", "no"];
function endClass(node, outcome) {
  if (node?.success) {
    if (node.success.includes(String(outcome))) return "success";
    return outcomeClass(outcome) === "preempted" ? "preempted" : "failure";
  }
  const isFinding = node && WATCHING.includes(node.kind) && FINDINGS.includes(String(outcome).toLowerCase());
  return isFinding ? "other" : outcomeClass(outcome);
}
function commonClass(node, outcomes) {
  const classes = new Set(outcomes.map((outcome) => endClass(node, outcome)));
  const [first] = classes;
  return classes.size === 1 ? first : "other";
}

// src/core/playback.ts
var RATES = [0.25, 0.5, 1, 2, 4, 8, 16, 32, 64];
var MOST_KEYS = 200;
var instantAt = ({ t: t4, since, rate }, moment) => t4 + (moment - since) * rate;
var loopedAt = (t4, { from, to }) => t4 < to ? t4 : from + (t4 - from) % Math.max(1, to - from);
var FRAME_MS = 200;
var MOST_FRAMES = 150;
function framesOf({ from, to }) {
  const step = Math.max(FRAME_MS, (to - from) / MOST_FRAMES);
  const count = Math.max(1, Math.ceil((to - from) / step));
  const instants2 = Array.from({ length: count }, (_5, i4) => Math.min(to, from + i4 * step));
  return [...instants2, to];
}
var FILM_FRAME_MS = FRAME_MS;
function parseInstant(text2) {
  const found = /^(?:(?:(\d{1,4}):)?(\d{1,5}):)?(\d{1,7}(?:\.\d{0,6})?)$/.exec(text2.trim());
  if (!found) return null;
  const [, hours, minutes, seconds] = found;
  return Number(hours ?? 0) * 3600 + Number(minutes ?? 0) * 60 + Number(seconds);
}
function kindOf(e4) {
  if (e4.kind === "Failed" || e4.kind === "Left" && outcomeClass(e4.outcome) === "failure") return "failure";
  if (e4.kind === "GoalDone") return outcomeClass(e4.status) === "failure" ? "failure" : null;
  if (e4.kind === "PreemptRequested") return "preempt";
  return e4.kind === "GoalSent" ? "goal" : null;
}
var outcomeOf = (e4) => "outcome" in e4 && e4.outcome || "";
var Marks = class {
  /** by kind, and by key of userdata */
  #marks = /* @__PURE__ */ new Map();
  #count = 0;
  // number of events, including the dropped ones
  #gone = 0;
  /** keys of userdata that were written */
  keys = /* @__PURE__ */ new Set();
  push(events) {
    for (const e4 of events) {
      this.#count += 1;
      const mark = { number: this.#count, t: e4.stamp_ns / 1e6, path: e4.path, kind: e4.kind, outcome: outcomeOf(e4) };
      const kind = kindOf(e4);
      if (kind) this.#add(`kind ${kind}`, mark);
      if (e4.kind !== "UserdataWritten" || !this.keys.has(e4.key) && this.keys.size >= MOST_KEYS) continue;
      this.keys.add(e4.key);
      this.#add(`key ${e4.key}`, mark);
    }
  }
  #add(name, mark) {
    const known2 = this.#marks.get(name);
    if (known2) known2.push(mark);
    else this.#marks.set(name, [mark]);
  }
  /** Drop the marks of the oldest events of the run. @param count number of further dropped events */
  forget(count) {
    this.#gone += count;
    for (const marks of this.#marks.values()) {
      const kept = marks.findIndex((mark) => mark.number > this.#gone);
      marks.splice(0, kept < 0 ? marks.length : kept);
    }
  }
  /**
   * The number of events up to the next or previous mark; null if there is none. Marks at one instant count as one, and
   * of failures only those that did not come from a state inside.
   * @param name "kind failure", "kind preempt", "kind goal", or "key NAME"
   * @param shown number of kept events up to the instant shown
   * @param step 1: after it, -1: before
   */
  find(name, shown, step, model) {
    const marks = this.#marks.get(name) ?? [];
    const at = shown + this.#gone;
    const count = countWhile(marks, (mark) => mark.number <= at);
    const here = count > 0 && marks[count - 1].number === at ? marks[count - 1].t : null;
    for (let i4 = step > 0 ? count : count - 1; i4 >= 0 && i4 < marks.length; i4 += step)
      if (marks[i4].t !== here && isOrigin(marks[i4], model)) return marks[i4].number - this.#gone;
    return null;
  }
};
function isOrigin({ kind, path, outcome }, model) {
  const node = kind === "Left" ? model?.get(path) : void 0;
  return !node || !node.children.length && endClass(node, outcome) === "failure";
}

// src/core/run.ts
var KEYFRAME = 400;
var Run = class {
  base;
  now;
  events = [];
  spans = [];
  preempts = [];
  // each with a row for every state that was asked to stop
  frames = [];
  // states as JSON, one before every KEYFRAME events
  waits = [];
  // times in which states were paused, or asked
  open = /* @__PURE__ */ new Map();
  // spans of the running states, by path
  #waiting = /* @__PURE__ */ new Map();
  // the present waits, by path and kind
  begun = null;
  forgotten = 0;
  // number of the oldest events that were dropped
  /** @param base the state before the events */
  constructor(base, events) {
    this.base = JSON.stringify(base ?? emptyState());
    this.now = JSON.parse(this.base);
    this.#resume();
    this.push(events);
  }
  push(events) {
    for (const e4 of events) {
      if (this.events.length % KEYFRAME === 0) this.frames.push(JSON.stringify(this.now));
      this.events.push(e4);
      this.#follow(e4);
      foldOne(this.now, e4);
    }
  }
  /** Drop the oldest events if there are more than `limit`, in whole blocks of KEYFRAME; returns their number. */
  trim(limit) {
    const blocks = Math.floor((this.events.length - limit) / KEYFRAME);
    if (blocks < 1) return 0;
    const gone = blocks * KEYFRAME;
    this.frames.splice(0, blocks);
    this.base = this.frames[0] ?? JSON.stringify(this.now);
    this.events.splice(0, gone);
    this.forgotten += gone;
    const first = this.events.length ? timeOf(this.events[0]) : Infinity;
    const kept = (span) => span.to === null ? this.open.get(span.path) === span : span.to >= first;
    this.spans = this.spans.filter(kept);
    this.waits = this.waits.filter((one) => one.to === null || one.to >= first);
    this.preempts = this.preempts.filter((one) => one.rows.some(kept));
    this.begun = this.spans.reduce((least, span) => Math.min(least, span.from), first);
    return gone;
  }
  /** Open spans for the states that run in the base, and the preempt of some of them. */
  #resume() {
    const rows = [];
    for (const [path, state] of Object.entries(this.now.states)) {
      if (state.since == null) continue;
      const span = this.#openSpan(path, state.since / 1e6);
      if (state.preempt == null) continue;
      rows.push(
        Object.assign(span, {
          preempt: state.preempt / 1e6,
          asked: state.asked ?? null,
          serviced: ms(state.serviced),
          abandoned: ms(state.abandoned)
        })
      );
    }
    rows.sort((a5, b3) => a5.preempt - b3.preempt);
    if (rows.length) this.preempts.push({ from: rows[0].preempt, rows });
  }
  #openSpan(path, from) {
    const before = this.open.get(path);
    if (before) before.to = from;
    const span = { path, from, to: null, outcome: null, preempt: null, asked: null, serviced: null, abandoned: null };
    this.open.set(path, span);
    this.spans.push(span);
    if (this.begun == null || from < this.begun) this.begun = from;
    return span;
  }
  #wait(path, kind, from, text2) {
    if (this.#waiting.has(`${kind} ${path}`)) return;
    const wait = { path, kind, from, to: null, text: text2 };
    this.waits.push(wait);
    this.#waiting.set(`${kind} ${path}`, wait);
  }
  #endWaits(path, to, kinds) {
    for (const kind of kinds) {
      const wait = this.#waiting.get(`${kind} ${path}`);
      if (wait) wait.to = to;
      this.#waiting.delete(`${kind} ${path}`);
    }
  }
  /** What is told about visits besides their beginnings and ends. */
  #note(e4, t4) {
    const { path } = e4;
    const span = this.open.get(path);
    switch (e4.kind) {
      case "Paused":
        return this.#wait(path, "paused", t4, e4.reason === "pause" ? "paused" : `paused (${e4.reason})`);
      case "QuestionAsked":
        return this.#wait(path, "asks", t4, "asks");
      case "QuestionAnswered":
        return this.#endWaits(path, t4, ["asks"]);
      case "Resumed":
        return this.#endWaits(path, t4, ["paused"]);
      case "Entered":
      case "Left":
      case "Failed":
        return this.#endWaits(path, t4, ["paused", "asks"]);
      case "Started":
      case "Finished":
        for (const wait of this.#waiting.values()) wait.to = t4;
        return this.#waiting.clear();
      case "GoalSent":
        if (span) span.sent = { id: e4.goal_id, goal: e4.goal };
        return;
      case "Noted":
        if (span) span.note = e4.text;
        return;
      case "Retried":
        if (span) span.attempt = e4.attempt + 1;
    }
  }
  #follow(e4) {
    const t4 = timeOf(e4);
    this.#note(e4, t4);
    if (e4.kind === "Recovered") this.#recover(e4, t4);
    if (e4.kind === "Started" || e4.kind === "Entered") {
      if (e4.kind === "Started") {
        for (const span2 of this.open.values()) span2.to = t4;
        this.open.clear();
      }
      this.#openSpan(e4.path, t4);
      return;
    }
    const span = this.open.get(e4.path);
    if (!span) return;
    if (e4.kind === "Left" || e4.kind === "Failed" || e4.kind === "Finished") {
      Object.assign(span, { to: t4, outcome: e4.kind !== "Failed" && e4.outcome || RAISED });
      this.open.delete(e4.path);
    } else if (e4.kind === "PreemptRequested" && span.preempt === null) {
      const row = Object.assign(span, { preempt: t4, asked: requestOf(e4) });
      const last = this.preempts.at(-1);
      if (last?.rows.some((one) => one.to === null && this.open.get(one.path) === one)) last.rows.push(row);
      else this.preempts.push({ from: t4, rows: [row] });
    } else if (e4.kind === "PreemptServiced" && span.preempt !== null) span.serviced = t4;
    else if (e4.kind === "Abandoned" && span.preempt !== null) span.abandoned = t4;
  }
  /**
   * Continue the spans that the resumed mission is in, even if the end of its process had ended them. The outcome of
   * the others is unknown.
   */
  #recover(e4, t4) {
    const active = new Map(e4.active);
    for (const [path, span] of this.open) {
      if (active.has(path)) continue;
      span.to = t4;
      this.open.delete(path);
    }
    for (const [path, since] of active) {
      if (this.open.has(path)) continue;
      const last = this.spans.findLast((span) => span.path === path);
      if (last?.to != null && last.to * 1e6 >= since) {
        Object.assign(last, { to: null, outcome: null, preempt: null, asked: null, serviced: null, abandoned: null });
        this.open.set(path, last);
      } else this.#openSpan(path, since / 1e6);
    }
  }
  /**
   * The newest preempt at the instant t [ms], as it was then; null if there is none.
   * `holds` are the innermost states that were asked and still run.
   */
  preemptAt(t4) {
    const found = this.preempts.findLast((one) => one.from <= t4);
    if (!found) return null;
    const until = (at) => at !== null && at <= t4 ? at : null;
    const rows = found.rows.filter((row) => row.preempt <= t4).map((row) => ({
      ...row,
      to: until(row.to),
      serviced: until(row.serviced),
      abandoned: until(row.abandoned)
    }));
    const running = rows.filter((row) => row.to === null);
    const holds = innermost(running, (row) => row.path);
    const to = running.length ? null : Math.max(...rows.map((row) => row.to ?? t4));
    return { from: found.from, to, rows, holds };
  }
  /** The newest visit of a state that had begun at an instant; null if there is none. @param t [ms] */
  visitAt(path, t4 = Infinity) {
    return this.spans.findLast((one) => one.path === path && one.from <= t4) ?? null;
  }
  first() {
    return this.begun ?? (this.events.length ? timeOf(this.events[0]) : null);
  }
  last() {
    const newest3 = this.events.at(-1);
    return newest3 ? timeOf(newest3) : this.begun;
  }
  /** The number of events up to and including the instant t [ms]. */
  indexAt(t4) {
    return countWhile(this.events, (e4) => timeOf(e4) <= t4);
  }
  /** The state after the first `count` events. */
  after(count) {
    const frame = Math.min(Math.floor(count / KEYFRAME), this.frames.length - 1);
    if (frame < 0) return JSON.parse(this.base);
    const data = JSON.parse(this.frames[frame]);
    for (let i4 = frame * KEYFRAME; i4 < count; i4++) foldOne(data, this.events[i4]);
    return data;
  }
  /**
   * The userdata written during the last transition, and the state before it.
   * @param count number of events up to the instant shown
   */
  lastTransition(count) {
    const ends = ["Left", "Failed", "Finished", "Started", "Recovered"];
    let end = count - 1;
    while (end > 0 && !ends.includes(this.events[end]?.kind)) end--;
    let begin = end - 1;
    while (begin > 0 && !["Left", "Failed", "Started", "Recovered"].includes(this.events[begin]?.kind)) begin--;
    begin = Math.max(0, begin);
    const writes = this.events.slice(begin, count).filter((e4) => e4.kind === "UserdataWritten");
    return { before: this.after(begin), writes };
  }
};
var timeOf = (e4) => e4.stamp_ns / 1e6;

// src/core/scene.ts
var COLOURS = 8;
var MOST_POSES = 6e4;
var MOST_SEEN = 4e3;
var MOST_SERIES = 400;
var NEAR = 0.3;
var ENDED = { Left: 1, Failed: 1, Finished: 1 };
var robotOf = (action) => String(action ?? "").replace(/^\//, "").replace(/\/?[^/]*$/, "");
var GOALS = ["target_pose", "pose", "goal_pose", "goal"];
var FEEDBACK = ["base_position", "current_pose"];
var countUntil = (list, t4) => countWhile(list, (one) => one.t <= t4);
function newestAt(goals, t4) {
  const goal = goals[countUntil(goals, t4) - 1];
  return goal && (goal.to === null || t4 <= goal.to) ? goal : null;
}
var newRobot = () => ({
  poses: [],
  observed: null,
  scans: [],
  plans: [],
  goals: [],
  tasks: [],
  pieces: [],
  done: 0
});
var Scene = class {
  robots = /* @__PURE__ */ new Map();
  maps = [];
  /** values of topics, for plots */
  series = /* @__PURE__ */ new Map();
  /** beginning of the visit of each running state, by path */
  entered = /* @__PURE__ */ new Map();
  /** paths of the states that drive, in order of their first drive, which determines their colours */
  drivers = [];
  names = [];
  revision = 0;
  // counts the changes
  #robot(name) {
    let robot = this.robots.get(name);
    if (!robot) {
      robot = newRobot();
      this.robots.set(name, robot);
    }
    return robot;
  }
  addEvents(events) {
    for (const e4 of events) this.#event(e4, e4.stamp_ns / 1e6);
    if (events.length) this.revision += 1;
  }
  #event(e4, t4) {
    if (e4.kind === "Entered" || e4.kind === "Started") this.entered.set(e4.path, t4);
    else if (Object.hasOwn(ENDED, e4.kind)) this.entered.delete(e4.path);
    else if (e4.kind === "UserdataWritten") {
      for (const named of namedPlaces(e4.value)) this.names.push({ t: t4, ...named });
    } else if (e4.kind === "GoalSent") this.#goalSent(e4, t4);
    else if (e4.kind === "GoalFeedback") {
      const place = placeIn(e4.feedback, FEEDBACK);
      if (place) this.#pose(robotOf(e4.action), { t: t4, ...place }, false);
    } else if (e4.kind === "GoalDone") {
      const robot = this.robots.get(robotOf(e4.action));
      const goal = robot?.goals.findLast((one) => one.id === e4.goal_id);
      if (goal) Object.assign(goal, { to: t4, status: e4.status, text: e4.text });
      const task = robot?.tasks.findLast((one) => one.id === e4.goal_id);
      if (task) task.to = t4;
    }
  }
  #goalSent(e4, t4) {
    const place = placeIn(e4.goal, GOALS);
    const robot = this.#robot(robotOf(e4.action));
    const from = this.entered.get(e4.path) ?? t4;
    if (!place) {
      robot.tasks.push({ id: e4.goal_id, path: e4.path, visit: from, t: t4, to: null });
      if (robot.poses.length && robot.poses[robot.poses.length - 1].t > t4) this.#resetPieces(robot);
      return;
    }
    const goal = {
      id: e4.goal_id,
      path: e4.path,
      visit: from,
      t: t4,
      to: null,
      status: "ACTIVE",
      text: "",
      ...place
    };
    robot.goals.push(goal);
    if (!this.drivers.includes(e4.path)) this.drivers.push(e4.path);
    if (robot.poses.length && robot.poses[robot.poses.length - 1].t > t4) this.#resetPieces(robot);
  }
  /** Make the pieces of a robot's track anew. */
  #resetPieces(robot) {
    robot.pieces = [];
    robot.done = 0;
  }
  #pose(name, pose, observed) {
    const robot = this.#robot(name);
    if (observed && robot.observed === null) {
      robot.observed = pose.t;
      robot.poses.length = countUntil(robot.poses, pose.t);
      this.#resetPieces(robot);
    }
    if (!observed && robot.observed !== null && pose.t >= robot.observed) return;
    const last = robot.poses.at(-1);
    if (last && last.t > pose.t) {
      robot.poses.splice(countUntil(robot.poses, pose.t), 0, pose);
      this.#resetPieces(robot);
    } else if (!last || last.t < pose.t || last.x !== pose.x || last.y !== pose.y) robot.poses.push(pose);
    if (robot.poses.length > MOST_POSES) {
      robot.poses.splice(0, MOST_POSES / 4);
      this.#resetPieces(robot);
    }
  }
  addObserved(records) {
    for (const record of records) {
      const t4 = record.stamp_ns / 1e6;
      const take = own(OBSERVERS, record.what);
      take?.(this, record, t4, this.#robot(record.robot));
      if (record.what === "pose") {
        const [x3, y5, yaw] = record.at;
        this.#pose(record.robot, { t: t4, x: x3, y: y5, yaw }, true);
      }
    }
    if (records.length) this.revision += 1;
  }
  /** Whether there is anything to show on a map. */
  get isEmpty() {
    return !this.maps.length && ![...this.robots.values()].some((robot) => robot.poses.length || robot.goals.length);
  }
  /** The track of a robot, cut where another visit, or none, drives it. */
  piecesOf(robot) {
    for (; robot.done < robot.poses.length; robot.done++) {
      const pose = robot.poses[robot.done];
      const goal = newestAt(robot.goals, pose.t) ?? newestAt(robot.tasks, pose.t);
      const path = goal?.path ?? null;
      const visit = goal?.visit ?? null;
      const last = robot.pieces.at(-1);
      const moved2 = robot.done > 0 && robot.poses[robot.done - 1].x !== pose.x;
      if (path !== null && moved2 && !this.drivers.includes(path)) this.drivers.push(path);
      if (last && last.path === path && last.visit === visit) last.poses.push(pose);
      else {
        const before = last?.poses.at(-1);
        robot.pieces.push({ path, visit, poses: before ? [before, pose] : [pose] });
      }
    }
    return robot.pieces;
  }
  /** The number of the colour of a state's tracks; -1 if it has not driven. */
  colourOf(path) {
    return this.drivers.indexOf(path);
  }
  /** The pose of a robot at an instant; null if it is not known yet. */
  poseAt(robot, t4) {
    return robot.poses[countUntil(robot.poses, t4) - 1] ?? null;
  }
  /** The map at an instant; before the first one, the first one. */
  mapAt(t4) {
    return (this.maps[countUntil(this.maps, t4) - 1] ?? this.maps[0])?.map ?? null;
  }
  /** The name of a goal's place; "" if it has none. */
  placeName(goal) {
    const near = (one) => Math.hypot(one.x - goal.x, one.y - goal.y) < NEAR;
    return this.names.findLast(near)?.name ?? "";
  }
  /** The newest goal of a visit. */
  goalOf(path, visit) {
    for (const robot of this.robots.values()) {
      const goal = robot.goals.findLast((one) => one.path === path && one.visit === visit);
      if (goal) return goal;
    }
    return null;
  }
  /** The goal with an id, if it leads to a place. */
  goalWithId(id) {
    for (const robot of this.robots.values()) {
      const goal = robot.goals.findLast((one) => one.id === id);
      if (goal) return goal;
    }
    return null;
  }
  /**
   * The piece of a track nearest to a place, and the time at which the robot was there.
   * @param within [m]
   * @param until later poses are ignored [ms]
   */
  nearest(x3, y5, within3, until = Infinity) {
    let best = null;
    for (const robot of this.robots.values())
      for (const piece of this.piecesOf(robot))
        for (let i4 = 0; i4 < piece.poses.length && piece.poses[i4].t <= until; i4++) {
          const a5 = piece.poses[Math.max(0, i4 - 1)];
          const b3 = piece.poses[i4];
          const { far, part } = toSegment(x3, y5, a5, b3);
          if (far > within3 || best && far > best.far + 1e-6) continue;
          best = { piece, t: a5.t + part * (b3.t - a5.t), far };
        }
    return best;
  }
  /** The box around all places, and the map. */
  extent(t4) {
    const xs = [];
    const ys = [];
    const map = this.mapAt(t4);
    if (map)
      for (const [u4, v4] of [
        [0, 0],
        [map.width, 0],
        [0, map.height],
        [map.width, map.height]
      ]) {
        const place = cellAt(map, u4, v4);
        xs.push(place.x);
        ys.push(place.y);
      }
    else
      for (const robot of this.robots.values())
        for (const { x: x4, y: y6 } of [...robot.poses, ...robot.goals]) {
          xs.push(x4);
          ys.push(y6);
        }
    if (!xs.length) return null;
    const least = (all) => all.reduce((a5, b3) => Math.min(a5, b3));
    const most = (all) => all.reduce((a5, b3) => Math.max(a5, b3));
    const [x3, y5] = [least(xs), least(ys)];
    return { x: x3, y: y5, w: Math.max(1, most(xs) - x3), h: Math.max(1, most(ys) - y5) };
  }
};
function cellAt({ resolution, origin: [x3, y5, yaw] }, u4, v4) {
  const [c4, s4] = [Math.cos(yaw) * resolution, Math.sin(yaw) * resolution];
  return { x: x3 + c4 * u4 - s4 * v4, y: y5 + s4 * u4 + c4 * v4 };
}
function toSegment(x3, y5, a5, b3) {
  const [dx, dy] = [b3.x - a5.x, b3.y - a5.y];
  const long = dx * dx + dy * dy;
  const part = long ? Math.max(0, Math.min(1, ((x3 - a5.x) * dx + (y5 - a5.y) * dy) / long)) : 1;
  return { far: Math.hypot(a5.x + part * dx - x3, a5.y + part * dy - y5), part };
}
function pushLimited(list, one) {
  list.push(one);
  if (list.length > MOST_SEEN) list.splice(0, MOST_SEEN / 4);
}
function pushSeries(scene, name, unit, point) {
  const known2 = scene.series.get(name);
  if (known2) pushLimited(known2.points, point);
  else if (scene.series.size < MOST_SERIES) scene.series.set(name, { name, unit, points: [point] });
}
var OBSERVERS = {
  scan: (_scene, { at, first, step, ranges }, t4, robot) => pushLimited(robot.scans, { t: t4, at, first, step, ranges }),
  plan: (_scene, { points: points2 }, t4, robot) => pushLimited(robot.plans, { t: t4, points: points2 }),
  map(scene, { robot, resolution, width, height, origin, cells }, t4) {
    scene.maps.push({ t: t4, robot, map: { resolution, width, height, origin, cells } });
    scene.maps.sort((a5, b3) => a5.t - b3.t);
    if (scene.maps.length > 20) scene.maps.splice(1, 1);
  },
  value: (scene, { robot, name, value, unit }, t4) => pushSeries(scene, [robot, name].filter(Boolean).join("/"), unit, { t: t4, value }),
  values(scene, { topic, values }, t4) {
    for (const [path, value] of Object.entries(values))
      pushSeries(scene, path === "data" ? topic : `${topic}.${path}`, "", { t: t4, value });
  }
};
function scanPoints({ at: [x3, y5, yaw], first, step, ranges }) {
  const points2 = [];
  ranges.forEach((cm, i4) => {
    const turn = yaw + first + i4 * step;
    if (cm >= 0) points2.push({ x: x3 + cm / 100 * Math.cos(turn), y: y5 + cm / 100 * Math.sin(turn) });
  });
  return points2;
}
function sceneText(scene, now) {
  const parts = [...scene.robots].flatMap(([name, robot]) => {
    const pose = scene.poseAt(robot, now);
    const goal = robot.goals.findLast((one) => one.t <= now && (one.to === null || one.to > now));
    const to = goal ? `, on its way to ${scene.placeName(goal) || placeText(goal)}` : "";
    return pose ? [`${name || "the robot"} at ${placeText(pose)}${to}`] : [];
  });
  return `map: ${parts.join("; ") || "no robot yet"}`;
}

// src/core/why.ts
function wayOf(why) {
  const ends = /* @__PURE__ */ new Map();
  for (const { path, outcome } of why?.steps ?? []) if (outcome) ends.set(`${path} ${outcome}`, { path, outcome });
  return [...ends.values()];
}

// src/core/store/data.ts
var Data = class {
  connection = y3("connecting");
  problem = y3("");
  // why the server refuses this page a stream
  settings = y3({
    follow: false,
    control: false,
    beat: 0,
    kept: 0,
    home: false,
    reproduces: false
  });
  machines = y3([]);
  wanted = y3("");
  // name of the machine to show
  facts = y3(null);
  // of the machine shown
  problems = y3([]);
  model = y3(null);
  statistics = y3(null);
  gap = y3(null);
  // number of events that this page missed
  /** Null before they are known. */
  actions = y3(null);
  comparison = y3(null);
  failure = y3(null);
  // why nothing is shown
  why = y3(null);
  // the causes of the run's end, while they are shown
  /** The ends of states that led to the outcome. */
  wayShown = O(() => wayOf(this.why.value));
  runs = y3({
    runs: [],
    folders: [],
    journals: []
  });
  runsKnown = y3(false);
  runsProblem = y3("");
  // why the runs cannot be listed
  simulations = y3({
    missions: {},
    batches: []
  });
  simulationsKnown = y3(false);
  run = new Run(emptyState(), []);
  scene = new Scene();
  marks = new Marks();
  // targets of jumps
  robotLag = new Lag();
  viewerLag = new Lag();
  #lostAt = 0;
  // when the server was lost, on this clock [ms]
  constructor() {
    this.connection.subscribe((state) => {
      if (state === "live") this.#lostAt = 0;
      else if (state === "lost") this.#lostAt ||= Date.now();
    });
  }
  startRun(base, events) {
    this.run = new Run(base, events);
    this.scene = new Scene();
    this.scene.addEvents(events);
    this.marks = new Marks();
    this.marks.push(events);
    this.gap.value = null;
  }
  /** Add new events; drop the oldest if there are more than the server keeps. Returns the number of those. */
  addEvents(events) {
    this.run.push(events);
    this.scene.addEvents(events);
    this.marks.push(events);
    const gone = this.run.trim(this.settings.value.kept || Infinity);
    if (gone) this.marks.forget(gone);
    return gone;
  }
  /** Add records of robot topics. */
  addObserved(records) {
    this.scene.addObserved(records);
  }
  /**
   * The present, or the end of a run that is over, on the robot's clock [ms since the epoch]. It stands still when the
   * server is lost, and at the last sign of life of a program that is gone.
   */
  liveMs() {
    const { run } = this;
    const about = this.facts.value;
    const isOver = run.now.ended != null || about?.recorded || this.connection.value === "file";
    const behind = ms(about?.behind) ?? 0;
    const lag = this.robotLag.value ?? (this.viewerLag.value ?? 0) + behind;
    const robot = about?.stale == null ? (this.#lostAt || Date.now()) - lag : about.stale / 1e6 - behind;
    return isOver ? run.last() ?? robot : Math.max(robot, run.last() ?? 0);
  }
  /** Whether there is nothing to show, nor on its way: no machine runs, or none with the name asked for. */
  isMissing = O(() => {
    if (this.connection.value !== "live" || this.model.value) return false;
    const wanted = this.wanted.value;
    return !this.machines.value.length || wanted !== "" && !this.machines.value.some(({ name }) => name === wanted);
  });
  /** The running innermost states now, independent of the instant shown. */
  runningLeaves() {
    const { states: states2 } = this.run.now;
    const paths = Object.keys(states2).filter((path) => states2[path].since != null);
    return innermost(paths, (path) => path);
  }
  /** The names of the robots that the machine shown drives: the namespaces of its actions, or its own. */
  robotNames() {
    const names = new Set(Object.values(this.run.now.goals).map((goal) => robotOf(goal.action)));
    for (const name of this.scene.robots.keys()) names.add(name);
    names.delete("");
    const own2 = this.facts.value?.name.split("/").slice(0, -1).join("/");
    return names.size || !own2 ? [...names].sort() : [own2];
  }
  /** The name of a state, with that of its container if several states have it. */
  nameOf(path) {
    const node = this.model.value?.get(path);
    if (!node) return shorten(path.slice(path.lastIndexOf("/") + 1));
    return node.isRepeated && node.parent?.parent ? `${node.parent.name} › ${node.name}` : node.name;
  }
  /**
   * Names of the actions that have a server and of those that had one; null before they are known. As JSON text, so
   * that the signal does not change when a new list has the same names.
   */
  serversSeen = O(() => {
    if (!this.actions.value) return null;
    const { actions: there, gone } = this.actions.value;
    return JSON.stringify([there.map((one) => one.name), gone]);
  });
};
var LAG_WINDOW_MS = 3e4;
var Lag = class {
  since = performance.now();
  least = Infinity;
  // in this window
  before = Infinity;
  // in the previous window
  forget() {
    this.since = performance.now();
    this.least = Infinity;
    this.before = Infinity;
  }
  /** @param t time on that clock when the message was sent [ms] */
  measure(t4) {
    if (performance.now() - this.since > LAG_WINDOW_MS) {
      this.since = performance.now();
      this.before = this.least;
      this.least = Infinity;
    }
    this.least = Math.min(this.least, Date.now() - t4);
  }
  get value() {
    const least = Math.min(this.least, this.before);
    return least === Infinity ? null : least;
  }
};

// src/core/series.ts
var MOST_POINTS = 2e4;
var MOST_FIELDS = 60;
var MOST_ITEMS = 8;
var MOST_DEPTH = 6;
var MOST_CHOICES = 400;
var LONGEST_ID = 400;
var MOST_PLOTS = 6;
var JUST_MS = 1e-3;
var MOST_LINES = 8;
var SOURCES2 = ["feedback", "progress", "userdata", "topic"];
var PROGRESS = {
  distance: ["distance left", "m", ({ distance }) => distance],
  fraction: ["progress", "%", ({ fraction }) => fraction === null ? null : 100 * fraction]
};
var idOf = ({ source, owner, path }) => [source, owner, ...path].map(encodeURIComponent).join(",");
function originOf(id) {
  if (id.length > LONGEST_ID) return null;
  try {
    const [word, owner, ...path] = id.split(",").map(decodeURIComponent);
    const source = SOURCES2.find((one) => one === word);
    const needsPath = source === "userdata" || source === "feedback" || source === "progress";
    if (!source || !owner || needsPath && !path.length) return null;
    return source === "progress" && !Object.hasOwn(PROGRESS, path[0]) ? null : { source, owner, path };
  } catch {
    return null;
  }
}
function knownPlots(plots) {
  if (!Array.isArray(plots)) return [];
  const lines = (plot) => (Array.isArray(plot) ? plot : []).filter((id) => typeof id === "string" && originOf(id)).slice(0, MOST_LINES);
  return plots.map(lines).filter((plot) => plot.length).slice(0, MOST_PLOTS);
}
function labelOf({ source, owner, path }) {
  if (source === "progress") return PROGRESS[path[0]][0];
  if (source === "feedback") return path.slice(-2).join(".");
  return source === "userdata" ? path.join(".") : [owner, ...path].join(".");
}
var ownerOf = ({ source, owner }) => source === "topic" ? "" : owner;
var unitOf = ({ source, path }) => source === "progress" ? PROGRESS[path[0]][1] : "";
function partsOf(value) {
  const fields2 = fieldsOf(value);
  if (fields2) return Object.entries(fields2).slice(0, MOST_FIELDS);
  const branch = branchOf(value);
  if (typeof branch === "string") return null;
  const most = Array.isArray(value) ? MOST_ITEMS : MOST_FIELDS;
  return branch.parts.slice(0, most).map(([name, part], i4) => [unquoted(name) ?? String(i4), part]);
}
var unquoted = (name) => name?.replace(/^(['"])(.*)\1$/, "$2");
function numberOf(value) {
  if (typeof value === "boolean") return value ? 1 : 0;
  const number = isTree(value) && typeof value.$int === "string" ? Number(value.$int) : value;
  return typeof number === "number" && Number.isFinite(number) ? number : null;
}
function numberAt(whole2, path) {
  let value = whole2;
  for (const name of path) {
    const part = partsOf(value)?.find(([one]) => one === name);
    if (!part) return null;
    value = part[1];
  }
  return numberOf(value);
}
function numbersIn(value) {
  const found = [];
  const look = (one, path) => {
    if (found.length >= MOST_FIELDS) return;
    if (numberOf(one) !== null) found.push(path);
    else if (path.length < MOST_DEPTH) for (const [name, part] of partsOf(one) ?? []) look(part, [...path, name]);
  };
  look(value, []);
  return found;
}
function originsIn(data, topics) {
  const found = /* @__PURE__ */ new Map();
  const add = (source, owner, path) => {
    const origin = { source, owner, path };
    if (found.size < MOST_CHOICES) found.set(idOf(origin), origin);
  };
  for (const name of topics) add("topic", name, []);
  for (const goal of Object.values(data.goals))
    for (const name of Object.keys(PROGRESS))
      if (goal.progress && PROGRESS[name][2](goal.progress) !== null) add("progress", goal.action, [name]);
  for (const { container, key, value } of Object.values(data.userdata))
    for (const path of numbersIn(value)) add("userdata", container, [key, ...path]);
  for (const goal of Object.values(data.goals))
    for (const path of numbersIn(goal.feedback)) if (path.length) add("feedback", goal.action, path);
  return [...found.values()].filter((origin) => originOf(idOf(origin)));
}
function usualPlots(data, topics) {
  const batteries = [...topics].filter((name) => /(^|\/)battery$/.test(name));
  const actions = new Set(
    Object.values(data.goals).filter((goal) => goal.progress?.distance != null).map((goal) => goal.action)
  );
  return knownPlots([
    batteries.sort().map((owner) => idOf({ source: "topic", owner, path: [] })),
    [...actions].sort().map((owner) => idOf({ source: "progress", owner, path: ["distance"] }))
  ]);
}
var Samples = class {
  id;
  origin;
  isStep;
  list = [];
  #read = 0;
  // number of events that were read, including those the run has dropped since
  #run = null;
  #goal = "";
  // id of the goal with the newest feedback
  constructor(id) {
    this.id = id;
    this.origin = originOf(id);
    this.isStep = this.origin.source === "userdata";
  }
  update(run, topics) {
    const { source, owner } = this.origin;
    if (source === "topic") {
      this.list = topics.get(owner)?.points ?? [];
      return this.list;
    }
    if (this.#run !== run) {
      this.#run = run;
      this.#read = run.forgotten;
      this.list = [];
    }
    const first = Math.max(0, this.#read - run.forgotten);
    for (let i4 = first; i4 < run.events.length; i4++) this.#take(run.events[i4]);
    this.#read = run.forgotten + run.events.length;
    if (this.list.length > MOST_POINTS) this.list.splice(0, MOST_POINTS / 4);
    return this.list;
  }
  #take(e4) {
    const { source, owner, path } = this.origin;
    if (source === "userdata") {
      if (e4.kind === "UserdataWritten" && e4.key === path[0] && containerOf(e4.path) === owner)
        this.#put(e4, numberAt(e4.value, path.slice(1)));
      return;
    }
    if (!("action" in e4) || e4.action !== owner) return;
    if (e4.kind === "GoalFeedback") {
      if (e4.goal_id !== this.#goal) this.#put(e4, null, -JUST_MS);
      this.#goal = e4.goal_id;
      if (source === "feedback") this.#put(e4, numberAt(e4.feedback, path));
      else if (e4.progress) this.#put(e4, PROGRESS[path[0]][2](e4.progress));
    } else if (e4.kind === "GoalDone" && e4.goal_id === this.#goal) this.#put(e4, null, JUST_MS);
  }
  /** @param later [ms] */
  #put(e4, value, later = 0) {
    if (value !== null || this.list.length) this.list.push({ t: e4.stamp_ns / 1e6 + later, value });
  }
};
var valueAt = (list, t4) => list[countUntil(list, t4) - 1]?.value ?? null;
function numberText(value) {
  const size = Math.abs(value);
  if (value === 0 || Number.isInteger(value) && size < 1e6) return String(value);
  if (size >= 1e6 || size < 1e-3) return value.toExponential(2);
  return String(Number(value.toPrecision(size < 0.01 ? 2 : 4)));
}
function aligned(all, from, to, now) {
  const windows = all.map(({ list, isStep }) => {
    const shown = list.slice(Math.max(0, countUntil(list, from) - 1), countUntil(list, to) + 1);
    const last = shown.at(-1);
    return isStep && last && last.t < now ? [...shown, { t: now, value: last.value }] : shown;
  });
  const instants2 = [...new Set(windows.flatMap((list) => list.map((one) => one.t)))].sort((a5, b3) => a5 - b3);
  const place = new Map(instants2.map((t4, i4) => [t4, i4]));
  const columns = windows.map((list) => {
    const column = new Array(instants2.length).fill(void 0);
    for (const { t: t4, value } of list) column[place.get(t4)] = value;
    return column;
  });
  return [instants2, ...columns];
}

// src/core/links.ts
var MOST_OPEN = 100;
var LONGEST_OPEN = 6e3;
var MOST_NOTES = 20;
var LONGEST_NOTE = 300;
var LATEST = 1e15;
var instant = (at) => (Math.ceil(at * 1e3) / 1e6).toFixed(6);
function instantOf(text2) {
  if (!text2 || !/^\d{1,12}(\.\d{1,6})?$/.test(text2)) return null;
  const at = Number(text2) * 1e3;
  return at < LATEST ? at : null;
}
function fragmentOf({ at, selected, opened: opened2, notes, stretch, panels: panels2, plots }) {
  const words2 = new URLSearchParams();
  if (at !== null) words2.append("at", instant(at));
  if (selected !== null) words2.append("state", selected);
  const paths = opened2 ?? [];
  const fits = paths.length <= MOST_OPEN && paths.join("").length <= LONGEST_OPEN;
  for (const path of fits ? paths : []) words2.append("open", path);
  for (const note of notes.slice(-MOST_NOTES)) words2.append("note", `${instant(note.at)} ${note.text}`);
  if (stretch) words2.append("stretch", stretch.map(instant).join(" "));
  if (panels2) words2.append("panels", wordOf(panels2));
  for (const plot of plots ?? []) words2.append("plot", plot.join(";"));
  if (plots && !plots.length) words2.append("plot", "");
  return words2.toString();
}
function viewOf(text2) {
  const words2 = new URLSearchParams(text2.replace(/^#/, ""));
  const notes = [];
  for (const word of words2.getAll("note").slice(0, MOST_NOTES)) {
    const [, when, what] = /^(\S+) (.+)$/s.exec(word) ?? [];
    const at = instantOf(when ?? null);
    if (at !== null) notes.push({ at, text: what.slice(0, LONGEST_NOTE) });
  }
  const opened2 = words2.getAll("open").slice(0, MOST_OPEN);
  const view2 = {
    at: instantOf(words2.get("at")),
    selected: words2.get("state"),
    opened: null,
    notes,
    stretch: null,
    panels: arrangementOf(words2.get("panels")),
    plots: null
  };
  const [from, to] = (words2.get("stretch") ?? "").split(" ").map(instantOf);
  if (from && to && from < to) view2.stretch = [from, to];
  if (opened2.length) view2.opened = opened2;
  if (words2.has("plot")) view2.plots = knownPlots(words2.getAll("plot").map((plot) => plot.split(";")));
  return view2;
}
function withNotes(notes, more, most = MOST_NOTES) {
  const clean = more.map((one) => ({ ...one, text: one.text.trim().slice(0, LONGEST_NOTE) })).filter((one) => one.text);
  const isKnown = (one) => notes.some((other) => other.text === one.text && same(other, one));
  const all = [...notes, ...clean.filter((one) => !isKnown(one))].slice(-most);
  return all.sort((a5, b3) => a5.at - b3.at);
}
var same = (a5, b3) => Math.abs(a5.at - b3.at) < 0.01;

// src/core/store/notes.ts
var NOTED_RUNS = 30;
var Notes = class {
  shared = y3([]);
  own = y3([]);
  /** All of them, in the order of their instants. */
  all = O(() => withNotes(this.shared.value, this.own.value, Infinity));
  writtenAt = y3(null);
  // instant of the note that is being written [ms]
  #data;
  #playback;
  constructor(data, playback) {
    this.#data = data;
    this.#playback = playback;
  }
  /** Begin a note on the instant shown. */
  begin() {
    if (this.#data.run.first() !== null) this.writtenAt.value = this.#playback.nowMs();
  }
  /** Load this browser's notes on the machine shown. */
  load() {
    const { notes: kept } = notedRuns().find((one) => one?.epoch === this.#data.facts.value?.epoch) ?? {};
    this.own.value = Array.isArray(kept) ? kept : [];
  }
  /** Add notes to those of this browser. */
  add(more) {
    this.#set(withNotes(this.own.value, more));
  }
  /** Remove one of this browser's. */
  remove({ at, text: text2 }) {
    this.#set(this.own.value.filter((one) => one.at !== at || one.text !== text2));
  }
  #set(next) {
    const epoch2 = this.#data.facts.value?.epoch;
    this.own.value = next;
    if (!epoch2) return;
    const others = notedRuns().filter((one) => one?.epoch !== epoch2);
    save("notes", [...others, ...next.length ? [{ epoch: epoch2, notes: next }] : []].slice(-NOTED_RUNS));
  }
};
function notedRuns() {
  const all = saved("notes", []);
  return Array.isArray(all) ? all : [];
}

// src/core/store/panels.ts
var PLOTTED_MACHINES = 30;
var Panels = class {
  /** null: the usual one */
  arrangement = y3(arrangementOf(saved("panels", null)));
  hasMap = y3(false);
  // whether there is anything to show on a map
  /** ids of series by plot; null: no choice was made */
  plotsChosen = y3(null);
  #data;
  #playback;
  #view;
  #usualPlots = [];
  constructor(data, playback, view2) {
    this.#data = data;
    this.#playback = playback;
    this.#view = view2;
  }
  /** The arrangement in use; phones have a fixed one. */
  arrangementShown = O(
    () => this.#view.isPhone.value ? usual() : this.arrangement.value ?? usual()
  );
  /** Names of the panels that have something to show. */
  panelsThere = O(() => {
    const isThere = { map: this.hasMap.value, plots: this.plotsShown.value.length > 0 };
    return new Set(PANELS.filter((name) => isThere[name] ?? true));
  });
  /** @param next null: the usual one */
  arrange(next) {
    this.arrangement.value = next;
    save("panels", next && wordOf(next));
  }
  // -- plots ------------------------------------------------------------------------------------
  plotsShown = O(() => {
    this.#playback.watchSlowly();
    if (this.plotsChosen.value) return this.plotsChosen.value;
    const found = usualPlots(this.#playback.shown(), this.#data.scene.series.keys());
    const isMore = found.flat().length > this.#usualPlots.flat().length;
    if (isMore) this.#usualPlots = found;
    return this.#usualPlots;
  });
  get #machine() {
    return this.#data.model.value?.root.label;
  }
  /** Load the plots of the machine shown. */
  loadPlots() {
    const kept = saved("plots", {});
    this.#usualPlots = [];
    const mine = own(kept, this.#machine ?? "");
    this.plotsChosen.value = mine === void 0 ? null : knownPlots(mine);
  }
  setPlots(next) {
    const plots = knownPlots(next);
    this.plotsChosen.value = plots;
    if (plots.flat().length < next.flat().length)
      this.#view.notify(`There are ${MOST_PLOTS} plots of ${MOST_LINES} lines at most: remove one first`, "error");
    const name = this.#machine;
    if (name === void 0) return;
    const others = Object.entries(saved("plots", {})).filter(([one]) => one !== name);
    save("plots", Object.fromEntries([...others, [name, plots]].slice(-PLOTTED_MACHINES)));
  }
  /** @param number of the plot */
  addLine(number, id) {
    this.setPlots(this.plotsShown.value.map((ids, i4) => i4 === number ? [...ids, id] : ids));
  }
  /** @param number of the plot */
  removeLine(number, id) {
    this.setPlots(this.plotsShown.value.map((ids, i4) => i4 === number ? ids.filter((one) => one !== id) : ids));
  }
};

// src/core/store/playback.ts
var SHORTEST_MS = 20;
var Playback = class {
  /** The run changes in place, and often: these count the updates of what is drawn of it. */
  #updates = y3(0);
  #slowUpdates = y3(0);
  // of panels with much text
  cursor = y3(null);
  // the instant shown [ms]; null: now
  /** number of events up to there: several may have the same instant */
  #position = y3(null);
  instant = O(() => [this.cursor.value, this.#position.value]);
  rate = y3(saved("rate", 1));
  // of playing
  playing = y3(null);
  stretch = y3(null);
  // the selected part of the run [ms]
  looping = y3(false);
  // whether playing repeats the stretch
  filmed = y3(null);
  // progress of a film [%]
  followedKey = y3(null);
  // the userdata key whose changes are targets of jumps
  #data;
  #view;
  #stateAtCursor = null;
  constructor(data, view2) {
    this.#data = data;
    this.#view = view2;
  }
  /** Show the present of a new run. */
  restart() {
    this.#stateAtCursor = null;
    this.cursor.value = null;
    this.#position.value = null;
    this.playing.value = null;
    this.stretch.value = null;
    this.looping.value = false;
    this.followedKey.value = null;
  }
  /** Stay at the same event after the oldest ones were dropped. @param gone their number */
  forget(gone) {
    const at = this.#position.value;
    if (gone && at !== null) this.#position.value = Math.max(0, at - gone);
  }
  /** The state of the run at the instant shown. */
  shown() {
    return this.cursor.value === null ? this.#data.run.now : this.#stateAtCursor ?? this.#data.run.now;
  }
  /** The instant shown, on the robot's clock [ms since the epoch]. */
  nowMs() {
    return this.cursor.value ?? this.#data.liveMs();
  }
  /** The beginning of the run shown [ms]. */
  began() {
    return ms(this.shown().started) ?? this.#data.run.first();
  }
  /** The number of kept events up to the instant shown. */
  eventsShown() {
    return this.#position.value ?? this.#data.run.events.length;
  }
  /** Whether the instant shown moves by itself: a run is played, or a running one is shown live. */
  goes = O(() => {
    this.watch();
    const { run, facts, connection } = this.#data;
    const isOver = run.now.ended != null || facts.value?.recorded || facts.value?.stale != null;
    return this.playing.value !== null || this.cursor.value === null && !isOver && connection.value !== "file";
  });
  /** Have the panel or computed value that calls this updated with the run shown. Returns the number of updates. */
  watch() {
    return this.#updates.value;
  }
  /** The same less often, for a panel with much text. */
  watchSlowly() {
    return this.#slowUpdates.value;
  }
  /** Update who watches. */
  update() {
    this.#updates.value += 1;
  }
  /** Update who watches slowly. */
  updateSlow() {
    this.#slowUpdates.value += 1;
  }
  /** Update all. */
  renew() {
    this.update();
    this.updateSlow();
  }
  #show(t4, count) {
    this.#stateAtCursor = count === null ? null : this.#data.run.after(count);
    r3(() => {
      this.cursor.value = t4;
      this.#position.value = count;
      this.renew();
    });
  }
  /** The instant of the run that is nearest to another one [ms]. */
  #inRun(t4) {
    const { run } = this.#data;
    return Math.max(run.first() ?? t4, Math.min(t4, run.last() ?? t4));
  }
  /** Show the instant t [ms]; null: now. Playing continues from there. */
  seek(t4) {
    if (t4 === null) {
      this.playing.value = null;
      this.#show(null, null);
      return;
    }
    const within3 = this.#inRun(t4);
    if (this.playing.value) this.#playFrom(within3);
    this.#show(within3, this.#data.run.indexAt(within3));
  }
  /** Show the state after the first `count` events. */
  seekTo(count) {
    const event = this.#data.run.events[count - 1];
    this.playing.value = null;
    if (event) this.#show(event.stamp_ns / 1e6, count);
  }
  /** Go forward or back by a number of events. */
  seekEvent(step) {
    const to = Math.max(1, this.eventsShown() + step);
    const all = this.#data.run.events.length;
    if (to >= all && step > 0) this.seek(null);
    else this.seekTo(Math.min(to, all));
  }
  // -- playing ----------------------------------------------------------------------------------
  #playFrom(t4, since = performance.now()) {
    this.playing.value = { t: t4, since, rate: this.rate.value };
  }
  /** Pause or play; at the end of a run that is over, play from the beginning. */
  togglePlaying() {
    if (this.playing.value) this.playing.value = null;
    else if (this.goes.value) this.seek(this.nowMs());
    else {
      const t4 = this.cursor.value ?? this.#data.run.first();
      if (t4 === null) return;
      this.#playFrom(t4);
      this.seek(t4);
    }
  }
  /** While playing, show the instant that is due, and finally now. @param moment [ms] */
  playOn(moment) {
    if (!this.playing.value) return;
    const { run } = this.#data;
    const stretch = this.looping.value ? this.stretch.value : null;
    let t4 = instantAt(this.playing.value, moment);
    if (stretch && t4 >= stretch.to) {
      t4 = loopedAt(t4, stretch);
      this.#playFrom(t4, moment);
    }
    if (t4 >= (run.last() ?? t4)) this.seek(null);
    else this.#show(t4, run.indexAt(t4));
  }
  setRate(factor) {
    this.rate.value = factor;
    save("rate", factor);
    if (this.playing.value) this.seek(this.cursor.value);
  }
  // -- the selected stretch ---------------------------------------------------------------------
  /** Select a stretch of the run between two instants [ms]; none if it is too short. */
  selectStretch(a5, b3 = a5) {
    const [from, to] = [this.#inRun(Math.min(a5, b3)), this.#inRun(Math.max(a5, b3))];
    this.stretch.value = to - from >= SHORTEST_MS ? { from, to } : null;
    if (!this.stretch.value) this.looping.value = false;
  }
  /** Repeat the selected stretch, otherwise the visit of the selected state, otherwise the whole run. */
  toggleLoop() {
    const { run } = this.#data;
    this.looping.value = !this.looping.value;
    if (!this.looping.value) return;
    if (!this.stretch.value) {
      const selected = this.#view.selected.value;
      const visit = selected === null ? null : run.visitAt(selected, this.nowMs());
      if (visit) this.selectStretch(visit.from, visit.to ?? this.#data.liveMs());
      else this.selectStretch(run.first() ?? 0, run.last() ?? 0);
    }
    if (!this.stretch.value) {
      this.looping.value = false;
      this.#view.notify("There is nothing to loop over yet");
      return;
    }
    const { from, to } = this.stretch.value;
    const now = this.nowMs();
    const t4 = now >= from && now < to ? now : from;
    this.#playFrom(t4);
    this.seek(t4);
  }
  /** Move the beginning or end of the selected stretch to the instant shown. */
  moveStretch(end) {
    const { run } = this.#data;
    const at = this.nowMs();
    const other = end === "from" ? this.stretch.value?.to ?? run.last() : this.stretch.value?.from ?? run.first();
    const isTurned = other !== null && (end === "from" ? at >= other : at <= other);
    if (other === null || isTurned) this.#view.notify("The selected stretch would end before it begins", "error");
    else this.selectStretch(at, other);
  }
  // -- jumps ------------------------------------------------------------------------------------
  /** The number of events up to the next or previous mark; when live, the newest mark counts as the next one. */
  jumpOf(name, step) {
    const { marks, model, run } = this.#data;
    const next = marks.find(name, this.eventsShown(), step, model.value);
    if (next !== null || step < 0 || this.cursor.value !== null) return next;
    return marks.find(name, run.events.length + 1, -1, model.value);
  }
  /** Go to a mark, or notify the user that there is none. @param name of `Marks.find` */
  jump(name, step) {
    const count = this.jumpOf(name, step);
    if (count !== null) this.seekTo(count);
    else this.#view.notify(`No ${name.replace(/^kind |^key /, "")} ${step > 0 ? "ahead" : "before"}`);
  }
};

// src/core/store/pointer.ts
var Pointer = class {
  hovered = y3(null);
  /** The instant below the pointer in the timeline or a plot [ms]. */
  pointed = y3(null);
  #data;
  #playback;
  constructor(data, playback) {
    this.#data = data;
    this.#playback = playback;
  }
  /** Set the visit that the pointer is on, in the timeline or the map. */
  hover(visit) {
    const before = this.hovered.value;
    if (before?.path !== visit?.path || before?.from !== visit?.from) this.hovered.value = visit;
  }
  /** Set what the pointer is on: the visit of a state at an instant, or nothing. */
  hoverAt(path, t4 = this.#playback.nowMs()) {
    const span = path === null ? null : this.#data.run.visitAt(path, t4);
    this.hover(span && { path: span.path, from: span.from });
  }
  /** Whether the pointer is on the visit of a state at an instant [ms]. */
  isLit(path, t4) {
    const span = this.hoveredSpan();
    return span?.path === path && t4 >= span.from && t4 <= (span.to ?? Infinity);
  }
  /** Handlers for a row about a state at an instant: pointing at it or focusing it highlights the visit. */
  hoverHandlers(path, t4) {
    const enter2 = () => this.hoverAt(path, t4);
    const leave2 = () => this.hover(null);
    return { onPointerEnter: enter2, onPointerLeave: leave2, onFocusIn: enter2, onFocusOut: leave2 };
  }
  /** The span of the visit that the pointer is on. */
  hoveredSpan() {
    const visit = this.hovered.value;
    return visit && this.#data.run.spans.findLast((one) => one.path === visit.path && one.from === visit.from);
  }
};

// src/core/store/status.ts
var Status = class {
  #data;
  #playback;
  constructor(data, playback) {
    this.#data = data;
    this.#playback = playback;
  }
  activePaths = O(() => {
    this.#playback.watch();
    return Object.entries(this.#playback.shown().states).filter(([, state]) => state.since != null).map(([path]) => path);
  });
  activeLeaves = O(() => innermost(this.activePaths.value, (path) => path));
  /** The running innermost states; after the end of a run, the innermost state that was left last. */
  lastLeaves = O(() => {
    if (this.activeLeaves.value.length) return this.activeLeaves.value;
    const left = Object.entries(this.#playback.shown().states).filter(([, state]) => state.left != null);
    if (!left.length) return [];
    const depth = (path) => path.split("/").length;
    const [last] = left.reduce((a5, b3) => (b3[1].left ?? 0) > (a5[1].left ?? 0) ? b3 : a5);
    const entered = (this.#data.run.visitAt(last)?.from ?? 0) * 1e6;
    const isWithin = (path, top) => `${path}/`.startsWith(`${top}/`);
    const inside2 = left.filter(([path, state]) => isWithin(path, last) && (state.left ?? 0) >= entered);
    const end = innermost(inside2, ([path]) => path);
    const newest3 = end.reduce((a5, b3) => {
      const later = (b3[1].left ?? 0) - (a5[1].left ?? 0);
      return later > 0 || later === 0 && depth(b3[0]) > depth(a5[0]) ? b3 : a5;
    });
    return [newest3[0]];
  });
  runStatus = O(() => {
    this.#playback.watch();
    const data = this.#playback.shown();
    const about = this.#data.facts.value;
    const connection = this.#data.connection.value;
    const cutShort = data.ended == null && data.started != null;
    if (!about) return { word: "waiting", kind: "other" };
    if (this.#playback.cursor.value !== null) return { word: "replay", kind: "preempted" };
    if (connection === "file" && cutShort) return { word: "recording ends here", kind: "active" };
    if (about.stale != null && data.ended == null) return { word: "stale", kind: "waiting" };
    if (connection === "lost") return { word: "reconnecting", kind: "waiting" };
    if (data.ended != null) return { word: `ended: ${data.outcome}`, kind: outcomeClass(data.outcome) };
    if (asks(data)) return { word: "asks you", kind: "waiting" };
    if (about.control?.paused) return { word: this.#pausedText(data), kind: "waiting" };
    const { model } = this.#data;
    const isTidying = this.activeLeaves.value.some((path) => isInCleanup(model.value?.get(path)));
    const isAsked = data.states[model.value?.root.path ?? ""]?.preempt;
    if (isTidying) return { word: "tidying up", kind: isAsked ? "preempted" : "active" };
    if (isAsked) return { word: "preempting", kind: "preempted" };
    if (data.started == null) return { word: "not started", kind: "other" };
    return { word: about.recorded ? "recording ends here" : "running", kind: "active" };
  });
  /** The paused state and the reason, as text. */
  #pausedText(data) {
    const held = Object.entries(data.states).filter(([, state2]) => state2.waits != null);
    if (!held.length) return "paused";
    const [path, state] = held[0];
    const why = state.waits === "pause" ? "" : ` (${state.waits})`;
    return `paused before ${this.#data.nameOf(path)}${held.length > 1 ? ` and ${held.length - 1} more` : ""}${why}`;
  }
  /** Why commands are disabled; null if they are not. */
  whyDisarmed = O(() => {
    if (this.#playback.cursor.value !== null) return "You look at the past: back to live first (l)";
    if (this.#data.connection.value === "lost") return "The viewer's server does not answer";
    return this.#data.facts.value?.stale == null ? null : "The mission's program does not answer";
  });
  /** Whether a goal seems to wait for a server. A server behind a bridge has no token and shows only by its answers. */
  hasNoServer(goal) {
    const { serversSeen, connection, facts, run } = this.#data;
    if (serversSeen.value === null || !goal || goal.ended != null || goal.feedback != null) return false;
    if (connection.value !== "live" || this.#playback.cursor.value !== null) return false;
    if (facts.value?.stale != null || facts.value?.recorded) return false;
    const plain = (name2) => name2.replace(/^\//, "");
    const name = plain(goal.action);
    const [there, gone] = JSON.parse(serversSeen.value);
    if (there.includes(name)) return false;
    if (gone.includes(name)) return true;
    const answered = (one) => plain(one.action) === name && (one.feedback != null || one.result != null);
    return !Object.values(run.now.goals).some(answered);
  }
};
var asks = (data) => Object.values(data.states).some(({ since, question }) => since != null && question?.answered === null);

// src/core/store/view.ts
var AROUND = 60;
var SMALL = { names: 0.98, labels: 1.22 };
var NOTICE_MS = { info: 3e3, error: 8e3 };
var View = class {
  pageShown = y3("machine");
  // the page on view
  selected = y3(null);
  // path of a state
  query = y3("");
  // of the search
  follow = y3(false);
  implicit = y3(saved("implicit", false));
  numbers = y3("none");
  // a key of statistics.MODES
  theme = y3(saved("theme", "system"));
  opened = y3(/* @__PURE__ */ new Set());
  // paths of containers
  help = y3(false);
  paletteOpen = y3(false);
  shortcuts = y3(saved("shortcuts", true));
  // whether single keys do something
  sound = y3(saved("sound", true));
  // whether a new question makes a sound
  operator = y3(saved("operator", ""));
  // the name under which answers are given
  tokenAsked = y3(false);
  // whether the viewer refused this page's token
  scale = y3(1);
  // of the diagram
  /** Whether names of states, or labels of arrows where there are any, have less than 11 px. */
  textIsSmall = O(() => this.scale.value < (this.overview.value ? SMALL.names : SMALL.labels));
  treeOpen = y3(false);
  // on small screens, where the tree covers the page
  outline = y3(false);
  // whether the user wants tiles without arrows, with larger names
  overview = y3(false);
  // whether states are tiles without arrows, because many are open
  laidOut = y3(null);
  // progress of a long layout [states]
  dismissed = y3(null);
  // the previous run whose notice was closed
  pins = y3(new Set(saved("pins", [])));
  // ids of runs
  chosenAction = y3(null);
  logFilter = y3("all");
  laneFilter = y3("");
  // names of lanes that the timeline shows
  isPhone = y3(false);
  // whether there is room for only one part of the page
  part = y3("machine");
  // the part that a phone shows: machine, map, time or log
  notice = y3(null);
  #data;
  #autoDepth = 0;
  // levels opened automatically; 0: the user has chosen
  #noticeTimer;
  constructor(data) {
    this.#data = data;
  }
  notify(text2, kind = "info") {
    this.notice.value = { text: text2, kind };
    clearTimeout(this.#noticeTimer);
    this.#noticeTimer = setTimeout(() => {
      this.notice.value = null;
    }, NOTICE_MS[kind]);
  }
  /** @param id of a run */
  togglePin(id) {
    const next = new Set(this.pins.value);
    if (!next.delete(id)) next.add(id);
    this.pins.value = next;
    save("pins", [...next]);
  }
  // -- the machine and its open containers ------------------------------------------------------
  setModel(payload) {
    const next = new Model(payload, this.implicit.value);
    this.#data.model.value = next;
    if (payload !== this.#data.comparison.value?.model) this.#data.comparison.value = null;
    const known2 = saved(`open.${next.root.label}`, []).filter(
      (path) => next.get(path)?.children.length
    );
    this.outline.value = false;
    this.#autoDepth = known2.length ? 0 : next.readableDepth();
    this.opened.value = this.#autoDepth ? next.toDepth(this.#autoDepth) : new Set(known2);
  }
  setImplicit(on2) {
    this.implicit.value = on2;
    save("implicit", on2);
    const model = this.#data.model.value;
    if (model) this.#data.model.value = new Model(model.payload, on2);
  }
  /** Open one level less, unless the user has chosen; returns false if that is impossible. */
  openOneLevelLess() {
    const model = this.#data.model.value;
    if (this.#autoDepth < 2 || !model) return false;
    this.#autoDepth -= 1;
    this.opened.value = model.toDepth(this.#autoDepth);
    return true;
  }
  keepOpened(paths) {
    this.opened.value = paths;
    this.outline.value = false;
    this.#autoDepth = 0;
  }
  setOpened(paths) {
    this.keepOpened(paths);
    const model = this.#data.model.value;
    if (model) save(`open.${model.root.label}`, [...paths]);
  }
  /** Open only a state's container, with as many levels inside as are readable. */
  openAround(node) {
    const model = this.#data.model.value;
    const top = node.children.length ? node : node.parent;
    if (!model || !top) return;
    const below = top.depth + model.readableDepth(AROUND, top);
    const inside2 = model.order.filter(
      (one) => one.children.length && one.depth < below && (one === top || one.path.startsWith(`${top.path}/`))
    );
    this.follow.value = false;
    this.setOpened(new Set([...model.ancestors(top.path), ...inside2].map((one) => one.path)));
  }
  toggle(path) {
    const next = new Set(this.opened.value);
    if (!next.delete(path)) next.add(path);
    this.follow.value = false;
    this.setOpened(next);
  }
  /** Open the containers around a state; returns false if all are open. */
  reveal(path) {
    const around3 = this.#data.model.value?.ancestors(path) ?? [];
    const closed = around3.filter((node) => !this.opened.value.has(node.path));
    if (closed.length) this.setOpened(/* @__PURE__ */ new Set([...this.opened.value, ...closed.map((node) => node.path)]));
    return closed.length > 0;
  }
};

// src/core/store.ts
function createStore() {
  const data = new Data();
  const view2 = new View(data);
  const playback = new Playback(data, view2);
  const status = new Status(data, playback);
  const pointer = new Pointer(data, playback);
  const clock = new Clock(data, playback);
  const panels2 = new Panels(data, playback, view2);
  const notes = new Notes(data, playback);
  return {
    ...{ data, view: view2, playback, status, pointer, clock, panels: panels2, notes },
    startRun(base, events) {
      r3(() => {
        data.startRun(base, events);
        playback.restart();
        pointer.hovered.value = null;
      });
    },
    /** Add new events to the run. */
    addEvents(events) {
      playback.forget(data.addEvents(events));
    }
  };
}
var store = createStore();

// src/core/purposes.ts
var NAMES = ["name", "station", "place", "waypoint", "location", "target", "object", "item", "text"];
function purposeOf(id, { goal }) {
  const { scene } = store.data;
  const driven = scene.goalWithId(id);
  if (driven) return scene.placeName(driven) || placeText(driven);
  const fields2 = fieldsOf(goal) ?? {};
  for (const name of NAMES) if (typeof fields2[name] === "string" && fields2[name]) return shorten(fields2[name], 24);
  return "";
}
function goalText(id, goal) {
  const purpose = purposeOf(id, goal);
  const left = goal.progress?.distance;
  const name = goal.action.replace(/^\//, "");
  return `${name}${purpose ? ` → ${purpose}` : ""}${left == null ? "" : `, ${left.toFixed(1)} m left`}`;
}
function purposeOfVisit(span) {
  if (span.note) return shorten(span.note, 40);
  if (span.purpose !== void 0) return span.purpose;
  const found = span.sent ? purposeOf(span.sent.id, span.sent) : "";
  if (span.to !== null) span.purpose = found;
  return found;
}
function attemptText(path, attempt) {
  const retry = store.data.model.value?.get(path)?.details.find(([name]) => name === "retry")?.[1] ?? "";
  const most = /^(\d+) attempts/.exec(retry)?.[1];
  return `attempt ${attempt}${most ? ` of ${most}` : ""}`;
}
var tidies = (path) => isInCleanup(store.data.model.value?.get(path));
function wordsOf(name, span, now) {
  const took = duration(Math.max(0, Math.min(span.to ?? now, now) - span.from) / 1e3);
  const purpose = purposeOfVisit(span);
  const runs2 = span.to === null || span.to > now;
  const facts = [
    (span.attempt ?? 1) > 1 && attemptText(span.path, span.attempt ?? 1),
    tidies(span.path) && (runs2 ? "tidying up" : "tidied up"),
    runs2 && span.serviced !== null && span.serviced <= now && "cleaning up"
  ].filter(Boolean);
  const more = facts.map((fact) => `, ${fact}`).join("");
  const to = purpose && `→ ${purpose}`;
  const all = [
    `${name}${to && ` ${to}`}${more} ${took}`,
    `${name}${to && ` ${to}`}${more}`,
    to && `${to}${more} ${took}`,
    to || name,
    purpose || name
  ];
  return [...new Set(all.filter(Boolean))];
}
function insideText(path) {
  const leaf = store.status.activeLeaves.value.find((one) => one.startsWith(`${path}/`));
  if (leaf) return `${leaf.slice(leaf.lastIndexOf("/") + 1)} ${purposeOfState(leaf)}`.trim();
  const state = own(store.playback.shown().states, path);
  if (!state?.visits) return "not begun";
  return state.since != null ? purposeOfState(path) : state.error ?? state.outcome ?? "";
}
function purposeOfState(path) {
  const span = store.data.run.open.get(path);
  const purpose = span ? purposeOfVisit(span) : "";
  return [tidies(path) && "tidying up", purpose && `→ ${purpose}`].filter(Boolean).join(" ");
}

// src/core/requests.ts
var ANSWER_MS = 3e3;
var token = null;
var view = "";
function readToken() {
  const words2 = new URLSearchParams(location.hash.slice(1));
  const given = words2.get("token") || null;
  view = words2.get("view") ?? "";
  words2.delete("token");
  words2.delete("view");
  try {
    if (given) sessionStorage.setItem("smachpy.token", given);
    token = given ?? sessionStorage.getItem("smachpy.token");
  } catch {
    token = given;
  }
  const rest = String(words2);
  if (given || view) history.replaceState(null, "", location.pathname + location.search + (rest && `#${rest}`));
}
async function logIn() {
  const known2 = token ?? view;
  if (known2) await ask("/api/login", { method: "POST", body: JSON.stringify({ token: known2 }) });
}
var hasToken = () => token !== null && store.data.settings.value.control;
function setToken(text2) {
  const [, found] = /#token=([\w-]+)/.exec(text2) ?? /^\s*([\w-]+)\s*$/.exec(text2) ?? [];
  if (!found) return false;
  token = found;
  try {
    sessionStorage.setItem("smachpy.token", found);
  } catch {
  }
  return true;
}
var encoded = (text2) => encodeURIComponent(text2.replace(/\p{Surrogate}/gu, "�"));
var link = (what, more = "", machine = store.data.facts.value?.name ?? "") => `/api/${what}?machine=${encoded(machine)}${more}`;
async function ask(address, options = {}) {
  let answer;
  let text2;
  try {
    answer = await fetch(address, options);
    text2 = await answer.text();
  } catch (error) {
    return failure(`The viewer's server does not answer (${messageOf(error)}).`);
  }
  try {
    return JSON.parse(text2);
  } catch {
    const status = `${answer.status} ${answer.statusText}`.trim();
    const reason = [status, text2.trim().slice(0, 300)].filter(Boolean).join(": ");
    return failure(`The viewer's server answered ${reason}`);
  }
}
var failure = (text2) => ({ ok: false, text: text2, wants_token: false, problems: [] });
var isFailure = (answer) => typeof answer === "object" && answer !== null && "ok" in answer && answer.ok === false;
var messageOf = (error) => error instanceof Error ? error.message : String(error);
async function post(address, data) {
  const limit = new AbortController();
  const timer = setTimeout(() => limit.abort(), ANSWER_MS);
  const answer = await ask(address, {
    method: "POST",
    headers: { "content-type": "application/json", "x-smachpy-token": token ?? "" },
    body: JSON.stringify(data),
    signal: limit.signal
  });
  clearTimeout(timer);
  if (limit.signal.aborted)
    return failure(`no answer in ${ANSWER_MS / 1e3} s; it may still be carried out: look at the machine.`);
  if (isFailure(answer) && answer.wants_token) store.view.tokenAsked.value = true;
  return answer;
}
var askAction = (data) => post("/api/action", data);

// src/core/commands.ts
var MOST_NAMED = 4;
function control() {
  const facts = store.data.facts.value;
  return hasToken() && !facts?.recorded ? facts?.control ?? null : null;
}
function canAnswer() {
  const facts = store.data.facts.value;
  return hasToken() && store.data.connection.value === "live" && facts?.stale == null && !facts?.recorded;
}
var sent = y3(null);
var FAILED_MS = 8e3;
var keyOf = (name, path) => `${name} ${path ?? ""}`;
async function command(name, more = {}, machine = store.data.facts.value?.name ?? "") {
  if (store.status.whyDisarmed.value) {
    store.view.notify(store.status.whyDisarmed.value, "error");
    return false;
  }
  const mine = { key: keyOf(name, more.path), failure: null };
  sent.value = mine;
  const result = await post(link("control", "", machine), { command: name, ...more });
  const isNewest = sent.value === mine;
  if (result.ok) {
    if (name !== "answer") store.view.notify(`${name}${more.path ? ` ${more.path}` : ""}: done`);
    if (isNewest) sent.value = null;
  } else if (result.wants_token) {
    if (isNewest) sent.value = null;
  } else {
    const failure2 = `${name}: ${result.text ?? "refused"}`;
    store.view.notify(failure2, "error");
    if (isNewest) {
      const failed = { ...mine, failure: failure2 };
      sent.value = failed;
      setTimeout(() => {
        if (sent.value === failed) sent.value = null;
      }, FAILED_MS);
    }
  }
  return Boolean(result.ok);
}
var confirmation = y3(null);
var situationOf = (...more) => JSON.stringify([
  ...[
    store.data.facts.value?.name,
    store.data.facts.value?.epoch,
    store.data.run.now.started,
    store.data.run.now.ended
  ],
  ...[store.view.pageShown.value, store.status.whyDisarmed.value, ...more]
]);
function situationAt(path, within3) {
  const visits = store.data.run.now.states;
  const running = Object.keys(visits).filter((one) => visits[one].since != null && `${one}/`.startsWith(`${within3}/`));
  return situationOf(
    store.view.selected.value === path,
    running.map((one) => [one, visits[one].since])
  );
}
function askFirst(asked2) {
  confirmation.value = { ...asked2, was: asked2.situation() };
}
function confirmationNow() {
  const asked2 = confirmation.value;
  if (!asked2 || asked2.situation() === asked2.was) return asked2;
  confirmation.value = null;
  store.view.notify(`“${asked2.title}” was closed: what it was about has changed`, "error");
  return null;
}
function targetText() {
  const name = store.data.facts.value?.label ?? "";
  const robots = store.data.robotNames();
  if (!robots.length) return name;
  return robots.length === 1 ? `${name} on ${robots[0]}` : `${name} on ${robots.length} robots`;
}
function endsText(within3) {
  const inside2 = (path) => `${path}/`.startsWith(`${within3}/`);
  const { states: states2, goals } = store.data.run.now;
  const now = store.data.liveMs();
  const leaves = store.data.runningLeaves().filter(inside2);
  const running = leaves.slice(0, MOST_NAMED).map((path) => {
    const since = own(states2, path)?.since;
    return `${store.data.nameOf(path)}${since == null ? "" : ` (${duration((now - since / 1e6) / 1e3)})`}`;
  });
  const sentGoals = Object.entries(goals).filter(([, goal]) => goal.ended == null && inside2(goal.path));
  const targets = sentGoals.slice(0, MOST_NAMED).map(([id, goal]) => goalText(id, goal));
  const more = (count) => count > MOST_NAMED ? `, and ${count - MOST_NAMED} more` : "";
  return [
    running.length ? `Running: ${running.join(", ")}${more(leaves.length)}.` : "No state runs.",
    targets.length ? `Cancels the goal${targets.length > 1 ? "s" : ""} ${targets.join("; ")}${more(sentGoals.length)}.` : ""
  ].filter(Boolean);
}

// src/core/hub.ts
var SILENT_BEATS = 2;
var GONE_MS = 15e4;
var OPEN_MS = 20;
var TIDY_MS = 5e3;
var RETRY_MS = 1e3;
var MOST_FOLLOWED = 32;
var HEAD = /^\{"name": ?("(?:[^"\\]|\\.)*")/;
var Hub = class {
  isShared;
  #pages = /* @__PURE__ */ new Map();
  #stream = null;
  #names = [];
  // machines that the stream follows
  #lasts = /* @__PURE__ */ new Map();
  // newest event by machine
  #machines = /* @__PURE__ */ new Map();
  // the list, by name
  #settings = "";
  #actions = "";
  #standing = { state: "connecting", problem: "", wantsToken: false };
  #silence = 0;
  // half beats without a message
  #patience = SILENT_BEATS;
  // of an open stream [beats]; doubled when one was closed for its silence
  #watchdog;
  #due;
  /** @param where without a shared worker, a hidden page needs no stream */
  constructor({ isShared: isShared2 }) {
    this.isShared = isShared2;
  }
  add(port) {
    this.#pages.set(port, { follow: null, heard: Date.now(), follows: "", hasAll: false });
    port.onmessage = ({ data }) => this.#take(port, data);
  }
  #take(port, told) {
    const page2 = this.#pages.get(port) ?? { follow: null, heard: 0, follows: "", hasAll: false };
    page2.heard = Date.now();
    this.#pages.set(port, page2);
    if (told.kind === "bye") {
      this.#pages.delete(port);
      this.#open(TIDY_MS);
    } else if (told.kind === "reconnect") {
      this.#standing = { state: "lost", problem: "", wantsToken: false };
      this.#tellAll({ event: "standing", standing: this.#standing });
      this.#open(0, true);
    } else if (told.kind === "follow") {
      const isNew2 = page2.follow === null;
      page2.follow = told;
      page2.follows = told.machine;
      if (isNew2 && this.#stream?.readyState === 1) this.#greet(port);
      page2.hasAll = told.last !== "" && this.#stream !== null && this.#lasts.get(told.machine) === told.last;
      if (told.hidden) this.#open(TIDY_MS);
      else if (!page2.hasAll) this.#open(OPEN_MS, true);
    }
  }
  /** Tell a page what is the same for all. */
  #greet(port) {
    if (this.#settings) port.postMessage({ event: "settings", text: this.#settings });
    port.postMessage({ event: "machines", text: JSON.stringify([...this.#machines.values()]) });
    if (this.#actions) port.postMessage({ event: "actions", text: this.#actions });
    port.postMessage({ event: "standing", standing: this.#standing });
  }
  #tellAll(message) {
    for (const [port, { follow: follow3 }] of this.#pages) if (follow3) port.postMessage(message);
  }
  /** The pages that are to get the events of their machine. */
  get #looking() {
    for (const [port, { heard }] of this.#pages) if (Date.now() - heard > GONE_MS) this.#pages.delete(port);
    return [...this.#pages.values()].filter(({ follow: follow3 }) => follow3 && !follow3.hidden);
  }
  /** Open a stream for what the pages follow now, in a moment. @param pause [ms] */
  #open(pause, anyway = false) {
    clearTimeout(this.#due);
    this.#due = setTimeout(() => this.#openNow(anyway), pause);
  }
  /** @param anyway also if it follows these machines already */
  #openNow(anyway) {
    const looking = this.#looking;
    const first = this.#firstMachine();
    for (const page2 of looking) page2.follows ||= first;
    const names = [...new Set(looking.map(({ follows }) => follows))].filter(Boolean).slice(0, MOST_FOLLOWED);
    const isSame = names.length === this.#names.length && names.every((name) => this.#names.includes(name));
    if (isSame && !anyway) return;
    this.#close();
    this.#names = names;
    this.#lasts.clear();
    if (!looking.length && (!this.isShared || !this.#pages.size)) return;
    const words2 = ["actions=1"];
    for (const name of names) {
      const of = looking.filter(({ follows }) => follows === name).map(({ follow: follow3 }) => follow3);
      const last = of.map((one) => one.last).reduce(older);
      words2.push(`machine=${encoded2(name)}`, `last=${encoded2(last)}`);
      words2.push(`seen=${last ? of.reduce((least, one) => Math.min(least, one.seen), Infinity) : -1}`);
      this.#lasts.set(name, last);
    }
    for (const page2 of looking) page2.hasAll = page2.follow?.last !== "" && names.includes(page2.follows);
    this.#listen(new EventSource(`/api/events?${words2.join("&")}`));
  }
  #close() {
    this.#stream?.close();
    this.#stream = null;
    clearInterval(this.#watchdog);
  }
  #listen(stream) {
    this.#stream = stream;
    for (const event of ["settings", "beat", "machines", "actions", "facts", "snap", "observed", "gap", "events"])
      stream.addEventListener(event, (message) => {
        if (stream !== this.#stream) return;
        this.#silence = 0;
        this.#pass(event, message.data);
        this.#remember(message.lastEventId);
      });
    stream.onopen = () => this.#set("live");
    stream.onerror = () => {
      if (stream !== this.#stream) return;
      this.#set("lost");
      if (stream.readyState === 2) this.#askWhy(stream.url);
    };
    this.#watch(JSON.parse(this.#settings || "{}").beat);
  }
  /** Note how far the stream is, and with it the pages. @param id of a message */
  #remember(id) {
    const words2 = id.split(" ");
    if (!id || words2.length !== this.#names.length) return;
    for (const [i4, name] of this.#names.entries()) this.#lasts.set(name, decodeURIComponent(words2[i4]));
    for (const { follow: follow3, follows, hasAll } of this.#looking)
      if (follow3 && hasAll) follow3.last = this.#lasts.get(follows) ?? follow3.last;
  }
  #pass(event, text2) {
    const message = { event, text: text2 };
    if (event === "beat") {
      this.#patience = SILENT_BEATS;
      this.#set("live");
    } else if (event === "settings") {
      this.#settings = text2;
      this.#machines.clear();
      this.#watch(JSON.parse(text2).beat);
    } else if (event === "actions") this.#actions = text2;
    else if (event === "machines") {
      const { machines, gone } = JSON.parse(text2);
      for (const one of machines) this.#machines.set(one.name, one);
      for (const name of gone) this.#machines.delete(name);
      message.text = JSON.stringify([...this.#machines.values()]);
      if (this.#looking.some(({ follows }) => !follows) && this.#firstMachine()) this.#open(0);
    } else {
      const name = JSON.parse(HEAD.exec(text2)?.[1] ?? '""');
      for (const [port, page2] of this.#pages) {
        if (!page2.follow || page2.follow.hidden || page2.follows !== name) continue;
        page2.hasAll ||= event === "snap";
        if (page2.hasAll) port.postMessage(message);
      }
      return;
    }
    this.#tellAll(message);
  }
  /** The machine that a page shows which asks for none: as `smachpy_viz.live.machines.Machines.first`. */
  #firstMachine() {
    const all = [...this.#machines.values()].sort((a5, b3) => a5.name < b3.name ? -1 : 1);
    return (all.find((one) => one.stale === null) ?? all[0])?.name ?? "";
  }
  #set(state, problem = "", wantsToken = false) {
    const isSame = this.#standing.state === state && this.#standing.problem === problem;
    this.#standing = { state, problem, wantsToken };
    if (!isSame) this.#tellAll({ event: "standing", standing: this.#standing });
  }
  /** The server refused the stream: an EventSource does not tell why. */
  async #askWhy(address) {
    const limit = new AbortController();
    try {
      const answer = await fetch(address, { signal: limit.signal });
      if (!answer.ok) {
        const { text: text2, wants_token } = await answer.json();
        this.#set("lost", text2, wants_token === true);
      }
    } catch {
    }
    limit.abort();
    this.#open(RETRY_MS, true);
  }
  /**
   * Reconnect when the beats stay away: a broken connection shows no error for minutes. Beats are also missing while a
   * long message arrives over a slow link, so the next stream gets twice the time.
   * @param beat [s]
   */
  #watch(beat) {
    clearInterval(this.#watchdog);
    this.#silence = 0;
    if (!(beat > 0)) return;
    this.#watchdog = setInterval(() => {
      const isOpen2 = this.#stream?.readyState === 1;
      this.#silence += 1;
      if (this.#silence <= 2 * (isOpen2 ? this.#patience : SILENT_BEATS)) return;
      if (isOpen2) this.#patience *= 2;
      this.#set("lost");
      this.#open(0, true);
    }, beat * 500);
  }
};
function older(a5, b3) {
  const [i4, j3] = [a5.lastIndexOf(":"), b3.lastIndexOf(":")];
  if (!a5 || !b3 || a5.slice(0, i4) !== b3.slice(0, j3)) return "";
  return Number(a5.slice(i4 + 1)) < Number(b3.slice(j3 + 1)) ? a5 : b3;
}
var encoded2 = (text2) => encodeURIComponent(text2.replace(/\p{Surrogate}/gu, "�"));

// src/core/page_file.ts
var isFile = () => document.getElementById("run-data") !== null;
async function unpack(id) {
  const text2 = document.getElementById(id)?.textContent ?? "";
  const bytes = Uint8Array.from(atob(text2), (c4) => c4.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(plain).text();
}
async function bytesOf(text2) {
  const packed = Uint8Array.from(atob(text2), (c4) => c4.charCodeAt(0));
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(plain).arrayBuffer());
}
async function makeWorker(name) {
  if (!isFile()) return new Worker(`/${name}-worker.js`);
  const code = await unpack(`${name}-data`);
  return new Worker(URL.createObjectURL(new Blob([code], { type: "text/javascript" })));
}

// src/core/pages.ts
var PAGES = ["runs", "fleet", "actions", "simulate"];
function pageOf(search) {
  const asked2 = new URLSearchParams(search);
  return PAGES.find((name) => asked2.has(name)) ?? "machine";
}
function addressOf(address, name, machine) {
  const next = new URL(address);
  for (const other of PAGES) next.searchParams.delete(other);
  if (name !== "machine") next.searchParams.set(name, "");
  if (machine !== void 0 && machine !== next.searchParams.get("machine")) {
    next.searchParams.set("machine", machine);
    next.hash = "";
  }
  return String(next);
}
function showPage(name, { machine, replace = false } = {}) {
  const address = addressOf(location.href, name, machine);
  store.view.pageShown.value = name;
  if (address === location.href) return;
  if (replace) history.replaceState(null, "", address);
  else history.pushState(null, "", address);
}

// src/core/shared_notes.ts
var notesOf = (notes) => notes.map(({ stamp_ns, text: text2, by }) => ({ at: stamp_ns / 1e6, text: text2, by }));
async function readNotes() {
  if (isFile()) return;
  const machine = store.data.facts.value;
  const answer = await ask(link("notes"));
  const { name, epoch: epoch2 } = store.data.facts.value ?? {};
  if (name !== machine?.name || epoch2 !== machine?.epoch) return;
  if (isFailure(answer)) store.view.notify(`Notes: ${answer.text}`, "error");
  store.notes.shared.value = isFailure(answer) ? [] : notesOf(answer);
}
var addNote = (note) => isShared() ? change("add", note) : store.notes.add([note]);
var removeNote = (note) => note.by === void 0 ? store.notes.remove(note) : change("remove", note);
var isShared = () => hasToken() && !isFile();
async function change(what, { at, text: text2 }) {
  const by = store.view.operator.value.trim() || void 0;
  const note = { stamp_ns: Math.round(at * 1e6), text: text2, ...by && { by } };
  const answer = await post(link("notes"), { command: what, note });
  if (answer.ok) await readNotes();
  else if (!answer.wants_token) store.view.notify(`Note: ${answer.text}`, "error");
}

// src/core/connection.ts
var CAUGHT_UP_MS = 1e3;
var RETRY_MS2 = 250;
var LONGEST_RETRY_MS = 4e3;
var hub = null;
var streamBegan = 0;
var epoch = "";
var newest = 0;
var seen = -1;
var isNew = false;
var loads = 0;
var onEvents = () => {
};
var onMachine = () => {
};
var onObserved = () => {
};
var whyOfFile = null;
async function connect(handlers) {
  ({ onEvents, onMachine, onObserved } = handlers);
  readToken();
  if (isFile()) {
    const run = JSON.parse(await unpack("run-data"));
    store.data.connection.value = "file";
    if (run.view && location.hash.length < 2) handlers.onView(String(run.view));
    store.notes.shared.value = notesOf(run.notes ?? []);
    await takeSnapshot(run.snap, run.model);
    onObserved(run.observed ?? []);
    store.data.statistics.value = run.statistics ?? null;
    whyOfFile = run.why ?? null;
    return;
  }
  await logIn();
  store.data.wanted.value = new URLSearchParams(location.search).get("machine") ?? "";
  showPage(pageOf(location.search), { replace: true });
  addEventListener("popstate", () => {
    const machine = new URLSearchParams(location.search).get("machine") ?? store.data.wanted.value;
    store.view.pageShown.value = pageOf(location.search);
    if (machine !== store.data.wanted.value) follow(machine);
  });
  openHub();
  tellHub();
}
function choose(name) {
  showPage("machine", { machine: name });
  if (name !== store.data.wanted.value || store.data.facts.value?.name !== name) follow(name);
}
function follow(name) {
  store.data.wanted.value = name;
  store.data.facts.value = null;
  store.data.statistics.value = null;
  epoch = "";
  newest = 0;
  seen = -1;
  loads += 1;
  tellHub();
}
var HERE_MS = 2e4;
function openHub() {
  if (typeof SharedWorker === "undefined") {
    const { port1, port2 } = new MessageChannel();
    new Hub({ isShared: false }).add(port1);
    hub = port2;
  } else hub = new SharedWorker("/hub-worker.js", "smachpy").port;
  hub.onmessage = ({ data }) => takeMessage(data);
  setInterval(() => hub?.postMessage({ kind: "here" }), HERE_MS);
  document.addEventListener("visibilitychange", tellHub);
  addEventListener("pageshow", (e4) => e4.persisted && tellHub());
  addEventListener("pagehide", () => hub?.postMessage({ kind: "bye" }));
}
function tellHub() {
  streamBegan = performance.now();
  const last = epoch ? `${epoch}:${newest}` : "";
  hub?.postMessage({ kind: "follow", machine: store.data.wanted.value, last, seen, hidden: document.hidden });
}
var TAKERS = {
  settings(settings) {
    streamBegan = performance.now();
    const asked2 = new URLSearchParams(location.search);
    if (settings.home && !store.data.settings.value.home && !asked2.has("machine") && pageOf(location.search) === "machine")
      showPage("runs", { replace: true });
    store.data.settings.value = settings;
  },
  beat: (t4) => store.data.viewerLag.measure(t4),
  machines(list) {
    store.data.machines.value = list.sort((a5, b3) => a5.name < b3.name ? -1 : 1);
  },
  actions(found) {
    store.data.actions.value = found;
  },
  facts: takeFacts,
  snap: takeStreamed,
  gap({ missed }) {
    if (isNew) store.data.gap.value = missed;
  },
  observed({ records }) {
    const unknown = records.filter(({ n: n3 }) => (n3 ?? 0) > seen);
    for (const { n: n3 } of unknown) seen = Math.max(seen, n3 ?? 0);
    onObserved(unknown);
  },
  events: (told) => told.epoch === epoch && takeNew(told)
};
function takeMessage(message) {
  if ("standing" in message) {
    const { state, problem, wantsToken } = message.standing;
    store.data.connection.value = state;
    store.data.problem.value = problem;
    if (wantsToken) store.view.tokenAsked.value = true;
  } else TAKERS[message.event]?.(JSON.parse(message.text));
}
function takeNew({ seq, events }) {
  const unknown = events.filter((one) => one.seq > newest);
  newest = Math.max(newest, seq);
  if (!unknown.length) return;
  if (performance.now() - streamBegan > CAUGHT_UP_MS)
    store.data.robotLag.measure(unknown[unknown.length - 1].stamp_ns / 1e6);
  onEvents(unknown);
}
function takeStreamed(snapshot) {
  const [first] = snapshot.events;
  isNew = snapshot.epoch !== epoch || !first || first.seq - (first.dropped ?? 0) > newest + 1;
  if (isNew && snapshot.epoch === epoch && snapshot.seq === newest) isNew = false;
  if (!isNew) {
    takeFacts(snapshot);
    takeNew(snapshot);
    return;
  }
  epoch = snapshot.epoch;
  newest = snapshot.seq;
  seen = -1;
  takeSnapshot(snapshot);
}
var reconnect = () => hub?.postMessage({ kind: "reconnect" });
async function takeFacts(facts) {
  const before = store.data.facts.value;
  store.data.facts.value = facts;
  if (before && (before.noted !== facts.noted || before.epoch !== facts.epoch)) readNotes();
  if (before && before.revision !== facts.revision && before.epoch === facts.epoch) await load(facts);
}
async function takeSnapshot(snapshot, payload) {
  store.data.wanted.value ||= snapshot.name;
  const known2 = store.data.facts.value;
  const same2 = known2?.name === snapshot.name && known2.epoch === snapshot.epoch;
  if (!same2) {
    if (!payload) store.notes.shared.value = [];
    store.data.robotLag.forget();
    store.data.why.value = null;
  }
  r3(() => {
    store.data.facts.value = snapshot;
    store.data.problems.value = snapshot.problems;
    store.startRun(snapshot.base, snapshot.events);
    store.playback.renew();
  });
  if (payload) {
    store.view.setModel(payload);
    onMachine();
  } else if (same2 && store.data.model.value && known2.revision === snapshot.revision) onEvents([]);
  else await load(snapshot);
}
async function load(facts) {
  loads += 1;
  const mine = loads;
  let payload = null;
  for (let pause = RETRY_MS2; !payload; pause = Math.min(2 * pause, LONGEST_RETRY_MS)) {
    payload = await fetchModel(facts.name);
    if (!payload) await new Promise((done) => setTimeout(done, pause));
    if (mine !== loads) return;
  }
  store.view.setModel(payload);
  onMachine();
  readNotes();
  const statistics = await ask(link("statistics"));
  if (mine !== loads) return;
  if (isFailure(statistics)) store.view.notify(`Recorded runs: ${statistics.text}`, "error");
  store.data.statistics.value = isFailure(statistics) ? null : statistics;
}
async function fetchModel(name) {
  try {
    const answer = await fetch(`/api/model?machine=${encoded(name)}`);
    return answer.ok ? await answer.json() : null;
  } catch {
    return null;
  }
}
function takeToken(text2) {
  if (!setToken(text2)) return false;
  store.view.tokenAsked.value = false;
  logIn().then(reconnect);
  store.view.notify("Try again now");
  return true;
}
async function showWhy(open = store.data.why.value === null) {
  const shown = store.data.facts.value?.epoch;
  const answer = open ? whyOfFile ?? await ask(link("why")) : null;
  if (isFailure(answer)) store.view.notify(`Why: ${answer.text}`, "error");
  else if (shown === store.data.facts.value?.epoch) {
    store.data.why.value = answer;
    if (answer) store.view.part.value = "log";
  }
}

// src/core/two_runs.ts
var BEFORE_S = 30;
var AFTER_S = 60;
var NEAR_S = 2e-3;
function beginOf(run) {
  const started = run.events.find((e4) => e4.kind === "Started");
  return started ? started.stamp_ns / 1e6 : run.first() ?? 0;
}
function twoRuns({ recorded, now, model }, difference, aligned2) {
  const at = difference?.at ?? 0;
  const zero = aligned2 ? at : 0;
  const sides = [
    { run: recorded, zero, differs: at },
    { run: now, zero: zero + (aligned2 ? difference?.later ?? 0 : 0), differs: at + (difference?.later ?? 0) }
  ].map((side) => lanesOf(side, model, difference?.path ?? null));
  const order = new Map(model.order.map(({ path }, i4) => [path, i4]));
  const paths = [...new Set(sides.flatMap((lanes) => [...lanes.keys()]))];
  paths.sort((a5, b3) => (order.get(a5) ?? Infinity) - (order.get(b3) ?? Infinity));
  const nameOf2 = (path) => model.get(path)?.name ?? path.slice(path.lastIndexOf("/") + 1);
  const [old, today] = sides.map(
    (lanes) => paths.map((path) => ({ path, name: nameOf2(path), bars: lanes.get(path) ?? [] }))
  );
  const bars2 = [...old, ...today].flatMap((lane) => lane.bars);
  return {
    names: paths.map((path) => [path, nameOf2(path)]),
    recorded: old,
    now: today,
    from: Math.min(0, ...bars2.map((bar) => bar.from)),
    to: Math.max(1, ...bars2.map((bar) => bar.to))
  };
}
function around({ from, to }, zero) {
  return { from: Math.max(from, zero - BEFORE_S), to: Math.min(to, zero + AFTER_S) };
}
function lanesOf({ run, zero, differs }, model, path) {
  const began = beginOf(run);
  const last = run.last() ?? began;
  const seconds = (t4) => (t4 - began) / 1e3 - zero;
  const different = path === null ? null : visitAt(run.spans, path, began + 1e3 * (differs + NEAR_S));
  const lanes = /* @__PURE__ */ new Map();
  for (const span of run.spans) {
    const above = span.path.slice(0, span.path.lastIndexOf("/"));
    if (!above) continue;
    const isBranch = model.get(above)?.kind === "concurrence";
    const lane = isBranch ? span.path : above;
    const bars2 = lanes.get(lane) ?? [];
    lanes.set(lane, bars2);
    const node = model.get(span.path);
    bars2.push({
      path: span.path,
      name: node?.name ?? span.path.slice(above.length + 1),
      from: seconds(span.from),
      to: seconds(span.to ?? last),
      at: span.from,
      kind: span.to === null ? "active" : endClass(node, span.outcome),
      differs: span === different
    });
  }
  return lanes;
}
var visitAt = (spans, path, t4) => spans.findLast((one) => one.path === path && one.from <= t4) ?? null;

// src/core/reproduction.ts
var POLL_MS = 400;
var AGAIN = ", again ";
var newest2 = y3(null);
var twoRunsShown = y3(false);
function reproduction() {
  const one = newest2.value;
  return one && one.epoch === store.data.facts.value?.epoch ? one : null;
}
function canReproduce() {
  store.playback.watch();
  const facts = store.data.facts.value;
  if (!facts || isFile() || !hasToken() || !store.data.settings.value.reproduces) return false;
  if (facts.name.includes(AGAIN)) return false;
  return store.data.run.now.started != null && (store.data.run.now.ended != null || facts.recorded || facts.stale != null);
}
async function reproduce(what, expect = "") {
  const { name = "", epoch: epoch2 = "" } = store.data.facts.value ?? {};
  const asked2 = { command: "start", machine: name, what, expect };
  const answer = await post("/api/reproduce", asked2);
  if (isFailure(answer)) {
    if (!answer.wants_token) store.view.notify(`Reproduce: ${answer.text}`, "error");
    return;
  }
  const mine = { id: answer.id, what, epoch: epoch2, problem: "", found: null, now: null };
  newest2.value = mine;
  twoRunsShown.value = false;
  store.view.part.value = "log";
  await follow2(mine);
}
async function follow2(mine) {
  for (; ; ) {
    const answer = await ask(`/api/reproduction?id=${encoded(mine.id)}`);
    if (newest2.value?.id !== mine.id) return;
    if (isFailure(answer) || !answer.running) {
      const problem = isFailure(answer) ? answer.text : answer.problem;
      const found = isFailure(answer) ? null : answer.found;
      const now = found?.machine ? await runOf(found.machine) : null;
      if (newest2.value?.id !== mine.id) return;
      newest2.value = { ...mine, problem, found, now };
      twoRunsShown.value = found?.kind === "differs" && now !== null;
      return;
    }
    await new Promise((done) => setTimeout(done, POLL_MS));
  }
}
async function runOf(machine) {
  try {
    const answer = await fetch(link("export", "&format=jsonl", machine));
    const lines = (await answer.text()).split("\n").slice(1).filter(Boolean);
    const records = lines.map((line) => JSON.parse(line));
    return answer.ok ? new Run(
      null,
      records.filter(({ path }) => path)
    ) : null;
  } catch (error) {
    store.view.notify(`Today's run: ${error}`, "error");
    return null;
  }
}
var stopReproduction = (id) => post("/api/reproduce", { command: "stop", id });
function closeReproduction() {
  newest2.value = null;
  twoRunsShown.value = false;
}
function differenceAt() {
  const { found, now } = reproduction() ?? {};
  return found?.difference && now ? beginOf(store.data.run) + 1e3 * found.difference.at : null;
}
function seekDifference() {
  const at = differenceAt();
  if (at !== null) store.playback.seek(at);
}
function pins() {
  const at = differenceAt();
  return at === null ? store.notes.all.value : [...store.notes.all.value, { at, text: "≠ differs from today" }];
}

// src/drawing/address.ts
var WRITE_MS = 300;
var Address = class {
  #linked = viewOf(location.hash);
  // the view in the address, until it is shown
  #due;
  constructor() {
    const { view: view2, playback, panels: panels2, notes } = store;
    const chosen2 = [view2.selected, view2.opened, notes.own, playback.stretch, panels2.arrangement, panels2.plotsChosen];
    for (const one of [...chosen2, playback.instant]) one.subscribe(() => this.#write());
  }
  /** Take the view of the address again, or that of another fragment. */
  read(fragment = location.hash) {
    this.#linked = viewOf(fragment);
  }
  /** The address of the view. */
  get text() {
    const address = new URL(location.href);
    const name = store.data.facts.value?.name;
    if (name && !isFile()) address.searchParams.set("machine", name);
    address.hash = this.fragment;
    return String(address);
  }
  /** The view as the fragment of an address. */
  get fragment() {
    const { view: view2, playback, panels: panels2, notes } = store;
    const stretch = playback.stretch.value;
    return fragmentOf({
      at: playback.cursor.value,
      selected: view2.selected.value,
      opened: [...view2.opened.value],
      notes: notes.own.value,
      stretch: stretch && [stretch.from, stretch.to],
      panels: panels2.arrangement.value,
      plots: panels2.plotsChosen.value
    });
  }
  #write() {
    clearTimeout(this.#due);
    this.#due = setTimeout(() => {
      if (store.data.model.value && !this.#linked && store.view.pageShown.value === "machine")
        history.replaceState(null, "", `#${this.fragment}`);
    }, WRITE_MS);
  }
  /**
   * Show the view of the address, as far as it exists.
   * @param onInstant called before another instant than now is shown
   */
  show(onInstant) {
    const model = store.data.model.value;
    const linked2 = this.#linked;
    this.#linked = null;
    if (!linked2 || !model) return;
    const { view: view2, playback, panels: panels2, notes } = store;
    const known2 = linked2.opened?.filter((path) => model.get(path)?.children.length);
    if (known2?.length) view2.keepOpened(new Set(known2));
    if (linked2.notes.length) notes.add(linked2.notes);
    if (linked2.panels) panels2.arrangement.value = linked2.panels;
    if (linked2.stretch) playback.selectStretch(...linked2.stretch);
    if (linked2.plots) panels2.plotsChosen.value = linked2.plots;
    const { run } = store.data;
    const first = run.first();
    const isKept = first !== null && linked2.at !== null && linked2.at >= first && linked2.at <= (run.last() ?? first) + 1;
    if (isKept) {
      onInstant();
      playback.seek(linked2.at);
    } else if (linked2.at !== null) view2.notify("The instant of this link is not in this run", "error");
    if (linked2.selected === null) return;
    if (model.get(linked2.selected)) {
      view2.selected.value = linked2.selected;
      view2.reveal(linked2.selected);
    } else view2.notify("The state of this link is not in this machine", "error");
  }
};

// src/drawing/measure.ts
var context = null;
var widths = /* @__PURE__ */ new Map();
function measure(text2, size = 11, bold = false) {
  const key = `${size}${bold ? "b" : ""}${text2}`;
  const known2 = widths.get(key);
  if (known2 !== void 0) return known2;
  context ??= document.createElement("canvas").getContext("2d");
  context.font = `${bold ? 600 : 400} ${size}px Inter, "Liberation Sans", Arial, sans-serif`;
  const width = Math.ceil(context.measureText(text2).width) + 1;
  widths.set(key, width);
  return width;
}
function fitting(text2, width) {
  let short = text2;
  while (short.length > 1 && measure(short, 10) > width) short = `${short.slice(0, -2)}…`;
  return short;
}

// src/drawing/placed.ts
var SEP = "";
var LEAF_H = 26;
var DIRECTIONS = ["DOWN", "RIGHT"];
var pillWidth = (outcome) => measure(shorten(outcome), 9, true) + 15;
function leafWidth(node) {
  const closed = node.children.length ? 20 + measure(String(node.total - 1), 9) : 0;
  return Math.max(56, 44 + measure(node.shown, 11, true) + closed);
}
function boxesOf(layout, x3 = 0, y5 = 0, found = /* @__PURE__ */ new Map()) {
  found.set(layout.node.path, { x: x3, y: y5, w: layout.w, h: layout.h });
  for (const { node, inner, ...box } of layout.boxes)
    if (inner) boxesOf(inner, x3 + box.x, y5 + box.y, found);
    else found.set(node.path, { x: x3 + box.x, y: y5 + box.y, w: box.w, h: box.h });
  return found;
}
var isOpen = (node, open) => node.children.length > 0 && open.has(node.path);

// src/drawing/svg.ts
var NS = "http://www.w3.org/2000/svg";
var ICONS = {
  // in a box of 10 x 10
  action: "M2 1.2 8.6 5 2 8.8Z",
  service: "M1 3.4h7M6 1.2 8.4 3.4 6 5.6M9 6.8H2M4 4.6 1.6 6.8 4 9",
  monitor: "M5 1a4 4 0 1 0 0 8a4 4 0 1 0 0-8M5 3.4a1.6 1.6 0 1 0 0 3.2a1.6 1.6 0 1 0 0-3.2",
  condition: "M5 .8 9.2 5 5 9.2 .8 5Z",
  callback: "M4 5a1 1 0 1 0 2 0a1 1 0 1 0-2 0",
  state: "M4 5a1 1 0 1 0 2 0a1 1 0 1 0-2 0",
  machine: "M1 1.5h8v7H1ZM1 4h8",
  sequence: "M1 5h7M6 2.6 8.6 5 6 7.4",
  concurrence: "M3 1v8M7 1v8",
  iterator: "M8.4 5a3.4 3.4 0 1 1-1.2-2.6M8.6 .8v2.4H6.2",
  missing: "M2 2l6 6M8 2 2 8"
};
var STROKED = /* @__PURE__ */ new Set(["service", "machine", "sequence", "concurrence", "iterator", "missing", "condition"]);
function el(name, attributes = {}, ...children) {
  const made = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) if (value != null) made.setAttribute(key, String(value));
  made.append(...children);
  return made;
}
var icon = (kind, x3, y5) => el("path", {
  d: ICONS[kind] ?? ICONS.state,
  transform: `translate(${x3} ${y5})`,
  class: `icon ${STROKED.has(kind) ? "stroked" : ""}`
});
function roundedLine(points2, radius = 6) {
  const at = (p5) => `${p5.x.toFixed(1)} ${p5.y.toFixed(1)}`;
  let d5 = `M${at(points2[0])}`;
  for (let i4 = 1; i4 < points2.length - 1; i4++) {
    const [a5, b3, c4] = [points2[i4 - 1], points2[i4], points2[i4 + 1]];
    const before = Math.hypot(b3.x - a5.x, b3.y - a5.y);
    const after = Math.hypot(c4.x - b3.x, c4.y - b3.y);
    const r4 = Math.min(radius, before / 2, after / 2);
    if (r4 < 0.5) {
      d5 += `L${at(b3)}`;
      continue;
    }
    const from = { x: b3.x + (a5.x - b3.x) / before * r4, y: b3.y + (a5.y - b3.y) / before * r4 };
    const to = { x: b3.x + (c4.x - b3.x) / after * r4, y: b3.y + (c4.y - b3.y) / after * r4 };
    d5 += `L${at(from)}Q${at(b3)} ${at(to)}`;
  }
  return `${d5}L${at(points2[points2.length - 1])}`;
}
function middleOfLongest(points2) {
  let best = { x: points2[0].x, y: points2[0].y, length: -1 };
  for (let i4 = 1; i4 < points2.length; i4++) {
    const [a5, b3] = [points2[i4 - 1], points2[i4]];
    const length = Math.hypot(b3.x - a5.x, b3.y - a5.y);
    if (length > best.length) best = { x: (a5.x + b3.x) / 2, y: (a5.y + b3.y) / 2, length };
  }
  return best;
}
function arrowHeads() {
  const heads = ["success", "failure", "preempted", "other", "plain"].map(
    (kind) => el(
      "marker",
      {
        id: `arrow-${kind}`,
        class: `arrow ${kind}`,
        viewBox: "0 0 10 10",
        refX: 9,
        refY: 5,
        markerWidth: 6.5,
        markerHeight: 6.5,
        markerUnits: "userSpaceOnUse",
        orient: "auto-start-reverse"
      },
      el("path", { d: "M0 1 10 5 0 9Z" })
    )
  );
  return el("defs", {}, ...heads);
}

// src/drawing/picture.ts
var TAGS = { concurrence: "concurrent", iterator: "repeats", sequence: "sequence" };
var Picture = class {
  states = /* @__PURE__ */ new Map();
  arrows = /* @__PURE__ */ new Map();
  // by path of the state and outcome
  joins = /* @__PURE__ */ new Map();
  // by path of the container
  boxes = /* @__PURE__ */ new Map();
  cards = /* @__PURE__ */ new Map();
  // texts of the branches that are cards
  pills = /* @__PURE__ */ new Map();
  // by path of the container and outcome
  size = null;
  // null: nothing is drawn yet
  #model = null;
  #problems = /* @__PURE__ */ new Map();
  /** Build the elements of a layout. */
  build(layout, model, problems) {
    this.#model = model;
    this.#problems = groupByPath(problems);
    this.size = { x: 0, y: 0, w: layout.w + 16, h: layout.h + 16 };
    const built = document.createDocumentFragment();
    this.#container(layout, 8, 8, built);
    return built;
  }
  #container(layout, x3, y5, into) {
    const { node } = layout;
    const box = { x: x3, y: y5, w: layout.w, h: layout.h };
    this.boxes.set(node.path, box);
    const group = this.#group(node, `box ${node.kind}`);
    const frame = el("rect", { class: "frame", x: x3, y: y5, width: box.w, height: box.h, rx: 9 });
    frame.style.fill = `var(--depth${Math.min(node.depth, 11)})`;
    const name = measure(node.shown, 11, true) + (TAGS[node.kind] ? 60 : 0);
    const entry = layout.entry && layout.entry.y < 8 ? layout.entry.x : -1;
    const isCrossed = entry > 4 && entry < 30 + name && entry + 26 + name < box.w;
    const left = isCrossed ? x3 + entry - 2 : x3;
    const title = el("text", { x: left + 24, y: y5 + 13.5, class: "title" }, node.shown);
    const room = x3 + box.w - left - 42;
    title.style.setProperty("--longest", `${Math.max(11, 11 * room / name).toFixed(1)}px`);
    if (layout.head) {
      const size = 0.5 * layout.head;
      title.setAttribute("y", String(y5 + 0.7 * layout.head));
      title.setAttribute("x", String(x3 + 8));
      title.style.fontSize = `${size}px`;
    } else if (TAGS[node.kind]) title.append(el("tspan", { dx: 7, class: "tag" }, TAGS[node.kind]));
    group.append(frame, ...layout.head ? [] : [icon(node.kind, left + 9, y5 + 7.5)], title);
    this.#register(node, group, frame, null, { ...box, h: 26 }, box.w);
    into.append(group);
    if (layout.joins.length)
      this.joins.set(
        node.path,
        node.joins.map((join2) => ({ join: join2, path: node.path, text: null, lines: /* @__PURE__ */ new Map() }))
      );
    for (const edge of layout.edges) into.append(this.#edge(edge, x3, y5));
    for (const child of layout.boxes) {
      if (child.inner) this.#container(child.inner, x3 + child.x, y5 + child.y, into);
      else this.#leaf(child, x3 + child.x, y5 + child.y, into);
    }
    for (const edge of layout.edges) this.#edgeLabels(edge, x3, y5, into);
    if (layout.entry)
      into.append(el("circle", { class: "entry", cx: x3 + layout.entry.x, cy: y5 + layout.entry.y, r: 4.5 }));
    for (const { join: join2, ...place } of layout.joins)
      into.append(
        el(
          "rect",
          { class: "join", x: x3 + place.x, y: y5 + place.y, width: place.w, height: place.h, rx: 3 },
          el("title", {}, join2?.text ?? "the rules of this concurrence")
        )
      );
    for (const pill of layout.pills) {
      const drawn = outcomePill(node, pill, x3, y5);
      this.pills.set(node.path + SEP + pill.outcome, drawn);
      into.append(drawn);
    }
  }
  #group(node, className2) {
    const kind = KIND_NAMES[node.kind] ?? node.kind;
    const group = el("g", {
      class: `${className2}${node.change ? ` cmp-${node.change}` : ""}`,
      "data-path": node.path,
      role: "button",
      tabindex: -1,
      "aria-label": `${node.label}, ${kind}`
    });
    const details = node.details.map(([name, value]) => `${name}: ${value}`).join("\n");
    const found = (this.#problems.get(node.path) ?? []).map((one) => `⚠ ${one.text}`).join("\n");
    const lines = [node.path, node.change, node.note, `${node.type_name} (${kind})`, node.doc, details, found];
    queueMicrotask(() => group.prepend(el("title", {}, lines.filter(Boolean).join("\n").slice(0, 2e3))));
    return group;
  }
  #leaf(place, x3, y5, into) {
    const { node, w: w5, h: h5 } = place;
    this.boxes.set(node.path, { x: x3, y: y5, w: w5, h: h5 });
    const closed = node.children.length > 0;
    const group = this.#group(node, `leaf ${node.kind}${closed ? " closed" : ""}${place.card ? " card" : ""}`);
    const isNet = isPartOfNet(node);
    const rx = isNet ? node.kind === "transition" ? 0 : h5 / 2 : 7;
    const frame = el("rect", { class: "frame", x: x3, y: y5, width: w5, height: h5, rx });
    group.append(frame);
    if (closed && !place.card)
      group.append(el("rect", { class: "inner", x: x3 + 2.5, y: y5 + 2.5, width: w5 - 5, height: h5 - 5, rx: 5 }));
    const bar = el("rect", { class: "progress", x: x3 + 6, y: y5 + h5 - 4.6, width: w5 - 12, height: 2.6, rx: 1.3 });
    bar.style.transformOrigin = `${x3 + 6}px 0`;
    bar.style.transform = "scaleX(0)";
    group.append(bar);
    if (place.card) {
      this.#card(place, group, x3, y5);
      this.#register(node, group, frame, bar, { x: x3, y: y5 + 20, w: w5, h: h5 }, w5);
      into.append(group);
      return;
    }
    const nameWidth = measure(node.shown, 11, true) + 14;
    const spare = closed ? 20 + measure(String(node.total - 1), 9) : 0;
    const left = place.hasRows ? x3 + 10 : x3 + (w5 - nameWidth - spare) / 2;
    const middle = y5 + h5 / 2;
    if (!isNet) group.append(icon(node.kind, left, middle - 5));
    group.append(el("text", { class: "name", x: left + (isNet ? 7 : 14), y: middle + 3.9 }, node.shown));
    if (closed) {
      const inside2 = `⊞ ${node.total - 1}`;
      group.append(el("text", { class: "inside", x: left + nameWidth + 7, y: middle + 3.4 }, inside2));
    }
    for (const dot of place.dots) {
      const kind = endClass(node, dot.outcome);
      const end = { x: x3 + dot.x - 7, y: y5 + dot.y + 3.1, "text-anchor": "end" };
      group.append(el("circle", { class: `dot ${kind}`, cx: x3 + dot.x, cy: y5 + dot.y, r: 3.2 }));
      group.append(el("text", { class: `outcome ${kind}`, ...end }, shorten(dot.outcome)));
    }
    const room = place.dots.length ? place.nameWidth : w5;
    this.#register(node, group, frame, bar, { x: x3, y: y5, w: w5, h: h5 }, room);
    into.append(group);
  }
  /** Write the name of a branch, and below it what runs in it. */
  #card({ node, w: w5 }, group, x3, y5) {
    const inside2 = el("text", { class: "doing", x: x3 + 10, y: y5 + 36 }, "");
    group.append(
      icon(node.kind, x3 + 9, y5 + 9),
      el("text", { class: "name", x: x3 + 24, y: y5 + 18 }, fitting(node.shown, w5 - 70))
    );
    group.append(inside2);
    this.cards.set(node.path, { element: inside2, text: "" });
  }
  /**
   * Add the badges, which are empty at first, and keep the elements that change.
   * @param room for the name
   */
  #register(node, group, frame, bar, box, room) {
    const badge = el("text", { class: "badge", x: box.x + box.w - 5, y: box.y - 3, "text-anchor": "end" });
    const glyph = el("text", { class: "glyph", x: box.x + room - 8, y: box.y + 10, "text-anchor": "middle" });
    group.append(badge, glyph);
    const found = this.#problems.get(node.path);
    if (found) {
      group.classList.add("problem");
      const worst = found.some((one) => one.severity === "error") ? "failure" : "preempted";
      const centre = { x: box.x + 2, y: box.y + 5.4, "text-anchor": "middle" };
      group.append(el("circle", { class: `warning ${worst}`, cx: box.x + 2, cy: box.y + 2, r: 6.5 }));
      group.append(el("text", { class: "warning-text", ...centre }, "!"));
    }
    group.append(el("circle", { class: "stop", cx: box.x - 1, cy: box.y + Math.min(box.h, 26) / 2, r: 5 }));
    this.states.set(node.path, {
      group,
      frame,
      bar,
      badge: { element: badge, text: "" },
      glyph: { element: glyph, text: "" },
      part: 0,
      label: "",
      isBlank: false,
      node
    });
  }
  #edge(edge, x3, y5) {
    const points2 = edge.points.map((p5) => ({ x: p5.x + x3, y: p5.y + y5 }));
    const kind = edge.kind === "link" ? commonClass(this.#model?.get(edge.source), edge.outcomes) : edge.kind;
    const implicit = edge.link?.implicit ? " implicit" : "";
    const change3 = edge.link?.change ? ` cmp-${edge.link.change}` : "";
    const line = el("path", {
      class: `edge ${kind}${implicit}${change3}`,
      d: roundedLine(points2),
      "marker-end": `url(#arrow-${edge.kind === "link" ? kind : "plain"})`
    });
    if (edge.link && edge.link.join !== null) {
      const lines = this.joins.get(containerOf(edge.source))?.[edge.link.join]?.lines;
      for (const outcome of edge.outcomes) lines?.set(edge.link.source + SEP + outcome, line);
    }
    const arrow = { line, edge, count: null, note: "" };
    for (const { source, outcomes } of edge.also ?? [edge])
      for (const outcome of outcomes) {
        const key = source + SEP + outcome;
        this.arrows.set(key, [...this.arrows.get(key) ?? [], arrow]);
      }
    return line;
  }
  #edgeLabels(edge, x3, y5, into) {
    if (edge.join) {
      const [place2] = edge.labels;
      const known2 = this.joins.get(edge.source)?.find((one) => one.join === edge.join);
      if (!place2 || !known2) return;
      const text3 = joinText(edge.join, 0);
      const at = { x: x3 + place2.x, y: y5 + place2.y + 9.2, "text-anchor": "middle" };
      known2.text = { element: el("text", { class: "label joined", ...at }, text3), text: text3 };
      into.append(known2.text.element);
      return;
    }
    for (const label of edge.labels) {
      const place2 = { x: x3 + label.x, y: y5 + label.y + 9.2, "text-anchor": "middle" };
      const name = signed(edge.link?.change, shorten(label.text));
      const kind = endClass(this.#model?.get(edge.source), label.text);
      into.append(el("text", { class: `label ${kind}`, ...place2 }, name));
    }
    if (!edge.link) return;
    const { change: change3, note } = edge.link;
    const text2 = [!edge.labels.length && change3 ? CHANGE_SIGNS[change3] : "", note].filter(Boolean).join(" ");
    const middle = middleOfLongest(edge.points);
    const right = !edge.labels.some((label) => label.x > middle.x);
    const place = {
      x: x3 + middle.x + (right ? 4 : -4),
      y: y5 + middle.y - 3,
      "text-anchor": right ? "start" : "end"
    };
    const count = el("text", { class: "count", ...place }, text2);
    into.append(count);
    for (const arrow of this.arrows.get(edge.source + SEP + edge.outcomes[0]) ?? [])
      if (arrow.edge === edge) Object.assign(arrow, { count, note: text2 });
  }
};
function outcomePill(node, pill, x3, y5) {
  const byDefault = node.pills.find((one) => one.outcome === pill.outcome)?.by_default ? " default" : "";
  const shown = pill.from ? `${shorten(pill.outcome)}, from ${pill.from}` : shorten(pill.outcome);
  const place = { x: x3 + pill.x, y: y5 + pill.y, width: pill.w, height: pill.h, rx: pill.h / 2 };
  const centre = { x: place.x + pill.w / 2, y: place.y + pill.h / 2 + 3.1, "text-anchor": "middle" };
  return el(
    "g",
    { class: `pill ${outcomeClass(pill.outcome)}${byDefault}` },
    el("rect", place),
    el("text", centre, shown),
    ...shown === pill.outcome ? [] : [el("title", {}, shorten(pill.outcome, 400))]
  );
}
function groupByPath(problems) {
  const found = /* @__PURE__ */ new Map();
  for (const one of problems) found.set(one.path, [...found.get(one.path) ?? [], one]);
  return found;
}

// src/drawing/state_texts.ts
var BRIEF_MS = 400;
function glyphOf(state, kind) {
  if (state?.waits) return "⏸";
  if (state?.since != null) return state.preempt ? state.serviced ? "✓" : "■" : "";
  if (!kind) return "";
  if (state?.error) return "⚠";
  return { success: "✓", failure: "✕", preempted: "■", other: "" }[kind];
}
function statusOf(state, goal, noServer) {
  if (state?.since == null) return state?.outcome ?? "not visited";
  if (state.preempt) return `asked to stop${state.serviced ? ", cleaning up" : ""}`;
  return noServer && goal ? `no server of ${goal.action} seen` : state.resource ?? "running";
}
function elapsed(node, state, now) {
  const since = (ns) => Math.max(0, now - (ms(ns) ?? now)) / 1e3;
  const attempt = state.attempt ?? 1;
  if (since(state.since) * 1e3 < BRIEF_MS && !state.preempt && attempt < 2) return "";
  const parts = [];
  if (isInCleanup(node)) parts.push("tidying up");
  if (state.item != null) parts.push(`#${state.item + 1}`);
  if (state.resource) parts.push(shorten(state.resource, 40));
  if (attempt > 1) parts.push(`attempt ${attempt}`);
  if (!state.preempt) parts.push(duration(since(state.since)));
  else if (state.serviced) parts.push(`cleans up ${duration(since(state.serviced))}`);
  else {
    const grace = state.asked?.grace;
    parts.push(`asked to stop ${duration(since(state.preempt))}${grace != null ? ` of ${duration(grace)}` : ""}`);
  }
  return parts.join(" · ");
}
function tokensIn(plan, state) {
  const counts = /* @__PURE__ */ new Map();
  if (state?.marking) for (const place of state.marking) counts.set(place, (counts.get(place) ?? 0) + 1);
  else for (const child of plan.children) counts.set(child.label, child.tokens ?? 0);
  return (label) => counts.get(label) ?? 0;
}
function lackOf(plan, transition, tokensOf) {
  const inputs = plan.links.filter((link2) => link2.target === transition.label).map((link2) => link2.source);
  const empty = plan.children.filter((child) => inputs.includes(child.label) && !tokensOf(child.label));
  const places = empty.filter(isPartOfNet).map((child) => child.name);
  return places.length ? `lacks tokens in ${places.join(", ")}` : "";
}

// src/drawing/diagram.ts
var FLASH_MS = 380;
var FADE_MS = 5e3;
var CLASSES = ["success", "failure", "preempted", "other"];
var CARD_TEXT = 118;
var Diagram = class {
  svg;
  world;
  picture = new Picture();
  onActive;
  flashing = /* @__PURE__ */ new Map();
  // end of the flash of each element [ms]
  /** @param onActive called when a state may have begun or ended to run */
  constructor(svg2, onActive) {
    this.svg = svg2;
    this.onActive = onActive;
    this.world = el("g", { class: "world" });
    svg2.replaceChildren(arrowHeads(), this.world);
  }
  draw(layout, model, problems) {
    const isCompared = model.order.some((n3) => n3.change || n3.note || n3.edges.some((e4) => e4.change || e4.note));
    this.svg.classList.toggle("compared", isCompared);
    this.picture = new Picture();
    this.world.replaceChildren(this.picture.build(layout, model, problems));
  }
  /** The box around the machine; null before it is drawn. */
  get size() {
    return this.picture.size;
  }
  boxOf(path) {
    return path === null ? void 0 : this.picture.boxes.get(path);
  }
  /** Adapt titles and details to a scale. */
  showScale(k4) {
    this.svg.classList.toggle("far", k4 < 0.6);
    this.svg.classList.toggle("farther", k4 < 0.35);
    this.svg.style.setProperty("--title", `${Math.max(11, Math.min(11 / k4, 44)).toFixed(1)}px`);
  }
  /** Write into the cards what they say now. */
  paintCards(textOf) {
    for (const [path, card] of this.picture.cards) write(card, fitting(textOf(path), CARD_TEXT));
  }
  // -- restyling --------------------------------------------------------------------------------
  /**
   * @param now [ms]
   * @param goal the goal that the state waits for
   * @param noServer no action server is seen that would take it
   */
  paint(path, state, now, goal, noServer = false) {
    const view2 = this.picture.states.get(path);
    if (!view2 || isPartOfNet(view2.node)) return;
    const isBlank = !state && !goal;
    if (isBlank && view2.isBlank) return;
    view2.isBlank = isBlank;
    const active = state?.since != null;
    const asked2 = active && Boolean(state?.preempt);
    const kind = state?.outcome != null ? endClass(view2.node, state.outcome) : null;
    const classes = view2.group.classList;
    classes.toggle("active", active);
    classes.toggle("preempting", asked2);
    classes.toggle("serviced", asked2 && Boolean(state?.serviced));
    const asks2 = active && state.question?.answered === null;
    classes.toggle("waiting", Boolean(state?.waits) || active && noServer || asks2);
    classes.toggle("visited", (state?.visits ?? 0) > 0);
    for (const name of CLASSES) classes.toggle(`was-${name}`, !active && kind === name);
    classes.toggle("raised", !active && Boolean(state?.error));
    classes.toggle("faded", !active && state?.left != null && now - state.left / 1e6 > FADE_MS);
    write(view2.glyph, glyphOf(state, kind));
    write(view2.badge, active ? elapsed(view2.node, state, now) : view2.node.note || "");
    const part = active ? goal?.progress?.fraction ?? 0 : 0;
    if (view2.bar && view2.part !== part) {
      view2.part = part;
      view2.bar.style.transform = `scaleX(${part})`;
    }
    const label = [path, statusOf(state, goal, noServer), view2.node.change].filter(Boolean).join(", ");
    if (view2.label !== label) {
      view2.label = label;
      view2.group.setAttribute("aria-label", label);
    }
    this.onActive(path, active);
  }
  /** Show at the joins of a container how many conditions were met in its visit. */
  paintJoins(path, states2) {
    const since = own(states2, path)?.since ?? null;
    for (const { join: join2, text: text2, lines } of this.picture.joins.get(path) ?? []) {
      let come = 0;
      for (const [label, outcome] of join2.conditions) {
        const child = own(states2, `${path}/${label}`);
        const isThere = since !== null && child?.since == null && (child?.left ?? -1) >= since;
        const arrived = isThere && child?.outcome === outcome;
        if (arrived) come += 1;
        lines.get(label + SEP + outcome)?.classList.toggle("arrived", arrived);
      }
      if (text2) write(text2, joinText(join2, come));
    }
  }
  /** Show the tokens of a plan and, beside a waiting transition, why it does not fire. */
  paintNet(path, state) {
    const plan = this.picture.states.get(path)?.node;
    if (plan?.kind !== "plan") return;
    const tokensOf = tokensIn(plan, state);
    for (const child of plan.children) {
      const view2 = this.picture.states.get(child.path);
      if (!view2 || !isPartOfNet(child)) continue;
      const isTransition = child.kind === "transition";
      const tokens = isTransition ? 0 : tokensOf(child.label);
      const held = isTransition ? own(state?.held, child.label) : void 0;
      const isFired = isTransition && state?.since != null && state.fired === child.label;
      view2.group.classList.toggle("marked", tokens > 0);
      view2.group.classList.toggle("waiting", held !== void 0);
      view2.group.classList.toggle("fired", isFired);
      write(view2.badge, held ?? (tokens > 3 ? `●${tokens}` : "●".repeat(tokens)));
      const lacks = isTransition && held === void 0 ? lackOf(plan, child, tokensOf) : "";
      const facts = [held, lacks, tokens ? `${tokens} token${tokens > 1 ? "s" : ""}` : "", isFired ? "fired" : ""];
      const label = [child.name, KIND_NAMES[child.kind], ...facts].filter(Boolean).join(", ");
      if (view2.label === label) continue;
      view2.label = label;
      view2.group.setAttribute("aria-label", label);
      this.onActive(child.path, tokens > 0);
    }
  }
  /** Flash the arrows along which tokens have just moved. */
  flashFired(path, fired, now) {
    const transition = `${path}/${fired}`;
    const arrows = [...this.picture.arrows.values()].flat();
    for (const { line, edge } of arrows)
      if (edge.source === transition || edge.link?.target === fired && containerOf(edge.source) === path) {
        line.classList.add("taken");
        this.flashing.set(line, now + FLASH_MS);
      }
  }
  /** Update the clock of a running state. */
  updateBadge(path, state, now) {
    const view2 = this.picture.states.get(path);
    if (view2 && state.since != null) write(view2.badge, elapsed(view2.node, state, now));
  }
  /** Flash a transition that was just taken. */
  flash(path, outcome, now) {
    for (const { line } of this.picture.arrows.get(path + SEP + outcome) ?? []) {
      line.classList.add("taken");
      this.flashing.set(line, now + FLASH_MS);
    }
  }
  /** End the flashes whose time is over; returns whether any is left. */
  endFlashes(now) {
    for (const [line, until] of this.flashing)
      if (until < now) {
        line.classList.remove("taken");
        this.flashing.delete(line);
      }
    return this.flashing.size > 0;
  }
  /** Highlight the transitions that led to the end of a run. */
  showWay(ends) {
    this.mark(
      ends.map((one) => one.path),
      "on-way"
    );
    for (const { path, outcome } of ends) {
      for (const { line } of this.picture.arrows.get(path + SEP + outcome) ?? []) line.classList.add("on-way");
      this.picture.pills.get(path + SEP + outcome)?.classList.add("on-way");
    }
  }
  /** Give these states a class, and remove it from all others. */
  mark(paths, name) {
    for (const group of this.world.querySelectorAll(`.${name}`)) group.classList.remove(name);
    for (const path of paths) this.picture.states.get(path)?.group.classList.add(name);
  }
  /** Show numbers on transitions and heat on states. */
  showNumbers(countOf2, heatOf) {
    this.svg.classList.toggle("heated", Boolean(countOf2));
    for (const { line, edge, count: text2, note } of new Set([...this.picture.arrows.values()].flat())) {
      const found = edge.outcomes.map((outcome) => countOf2?.(edge.source, outcome) ?? { count: 0, share: 0 });
      const count = found.reduce((sum, one) => sum + one.count, 0);
      const share = found.reduce((sum, one) => sum + one.share, 0);
      line.style.strokeWidth = count ? `${Math.min(4, 1.2 + Math.log2(1 + count) * 0.6)}px` : "";
      line.classList.toggle("never", Boolean(countOf2) && !count);
      const percent2 = share && share < 0.995 ? ` ${Math.round(share * 100)}%` : "";
      if (text2) text2.textContent = count ? `×${count}${percent2}` : note;
    }
    for (const [path, { frame, group }] of this.picture.states) {
      if (group.classList.contains("box")) continue;
      const heat = Math.round((heatOf?.(path) ?? 0) * 100);
      frame.style.fill = heat ? `color-mix(in srgb, var(--failure-fill) ${heat}%, var(--inactive-fill))` : "";
    }
  }
};
function write(shown, text2) {
  if (shown.text === text2) return;
  shown.text = text2;
  shown.element.textContent = text2;
}

// src/drawing/follow.ts
var SETTLED_MS = 450;
var PAUSE_MS = 900;
var READABLE2 = 0.84;
var Follow = class {
  #lastOpen = "";
  #rearrangedAt = -Infinity;
  // [ms]
  /** Paths of the containers that should be open; null if nothing is to change. @param now [ms] */
  containersToOpen(now) {
    const model = store.data.model.value;
    const moment = performance.now();
    if (!model || moment - this.#rearrangedAt < PAUSE_MS) return null;
    const states2 = store.playback.shown().states;
    const open = /* @__PURE__ */ new Set([model.root.path]);
    const active = store.status.activePaths.value;
    const ended = active.length === 0;
    for (const path of ended ? store.status.lastLeaves.value.flatMap(around2) : active) {
      const since = ended ? 0 : states2[path]?.since;
      const node = model.get(path);
      if (node?.children.length && !model.isBranch(node) && since != null && now - since / 1e6 > SETTLED_MS)
        open.add(path);
    }
    const key = [...open].sort().join("\n");
    if (key === this.#lastOpen) return null;
    this.#lastOpen = key;
    this.#rearrangedAt = moment;
    return open;
  }
  /** Forget the open containers, so that the next call answers at once. */
  restart() {
    this.#lastOpen = "";
    this.#rearrangedAt = -Infinity;
  }
};
var around2 = (path) => store.data.model.value?.ancestors(path).map((node) => node.path) ?? [];
function boxOfActive(boxes) {
  const found = store.status.lastLeaves.value.flatMap((path) => {
    let at = path;
    while (at && !boxes.has(at)) at = at.slice(0, Math.max(0, at.lastIndexOf("/")));
    return boxes.get(at) ?? [];
  });
  if (!found.length) return null;
  const x3 = Math.min(...found.map((box) => box.x));
  const y5 = Math.min(...found.map((box) => box.y));
  const right = Math.max(...found.map((box) => box.x + box.w));
  const bottom = Math.max(...found.map((box) => box.y + box.h));
  return { x: x3, y: y5, w: right - x3, h: bottom - y5 };
}
function isLegible(boxes, view2) {
  const box = boxOfActive(boxes);
  return !box || view2.scaleFor(box) >= READABLE2;
}
function oneLevelLess(open) {
  const depth = (path) => path.split("/").length;
  const deepest = Math.max(...[...open].map(depth));
  const less = [...open].filter((path) => depth(path) < deepest);
  return less.length ? new Set(less) : null;
}
function boxToFrame(diagram, view2, whole2) {
  const leaves = store.status.lastLeaves.value;
  const model = store.data.model.value;
  const active = boxOfActive(diagram.picture.boxes);
  if (!active || !model) return whole2;
  const shared = model.ancestors(leaves[0]).filter((node) => leaves.every((leaf) => leaf.startsWith(`${node.path}/`)));
  for (const { path } of shared) {
    const box = diagram.boxOf(path);
    if (box && view2.scaleFor(box) >= READABLE2) return atLeast(box, view2);
  }
  if (view2.scaleFor(active) >= READABLE2) return atLeast(active, view2);
  const states2 = store.playback.shown().states;
  const newest3 = leaves.reduce((a5, b3) => (states2[b3]?.since ?? 0) > (states2[a5]?.since ?? 0) ? b3 : a5);
  const at = boxOfOne(diagram, newest3) ?? active;
  const [w5, h5] = [view2.width / READABLE2, view2.height / READABLE2];
  return { x: at.x + at.w / 2 - w5 / 2, y: at.y + at.h / 2 - h5 / 2, w: w5, h: h5 };
}
function boxOfOne(diagram, path) {
  for (let at = path; at; at = at.slice(0, Math.max(0, at.lastIndexOf("/")))) {
    const box = diagram.boxOf(at);
    if (box) return box;
  }
  return null;
}
function atLeast(box, view2) {
  const w5 = Math.max(box.w, view2.width * 0.9);
  const h5 = Math.max(box.h, view2.height * 0.9);
  return { x: box.x - (w5 - box.w) / 2, y: box.y - (h5 - box.h) / 2, w: w5, h: h5 };
}

// src/drawing/cards.ts
var CARD = { w: 136, h: 52 };
var GAP = 8;
var HEAD2 = 28;
var SIDE = 14;
var BRACKET = 6;
var ARM = 5;
var PILL_H = 15;
var ENTRY = 10;
var MOST_COLUMNS = 12;
var pillWidth2 = (outcome) => measure(shorten(outcome), 9, true) + 15;
function waysOf(node) {
  const ways = node.joins.map((join2) => ({
    ...{ join: join2, source: node.path, outcomes: [join2.outcome], outcome: join2.outcome },
    text: joinText(join2, join2.need - 1)
  }));
  const byTarget = /* @__PURE__ */ new Map();
  for (const link2 of node.links) {
    if (!link2.to_outcome || link2.join !== null) continue;
    byTarget.set(link2.target, [...byTarget.get(link2.target) ?? [], link2]);
  }
  for (const [outcome, links] of byTarget) {
    const also = links.map((link2) => ({ source: `${node.path}/${link2.source}`, outcomes: link2.outcomes }));
    const [{ source, outcomes }] = also;
    const text2 = links.length > 1 ? `any of ${links.length}` : `${links[0].source}: ${outcomes.join(", ")}`;
    ways.push({ link: links[0], source, outcomes, also, outcome, text: shorten(text2) });
  }
  return ways;
}
function cards(node, outer, aspect) {
  const count = node.children.length;
  const sizeOf = (columns) => {
    const w6 = columns * (CARD.w + GAP) - GAP;
    const h6 = Math.ceil(count / columns) * (CARD.h + GAP) - GAP;
    return { columns, w: w6, h: h6, cost: Math.max(w6 + 120, aspect * (h6 + 50)) };
  };
  const tried = Array.from({ length: Math.min(MOST_COLUMNS, count) }, (_5, i4) => sizeOf(i4 + 1));
  const grid2 = tried.reduce((a5, b3) => b3.cost < a5.cost ? b3 : a5);
  const boxes = node.children.map((child, i4) => ({
    x: SIDE + i4 % grid2.columns * (CARD.w + GAP),
    y: HEAD2 + Math.floor(i4 / grid2.columns) * (CARD.h + GAP),
    ...CARD,
    ...{ node: child, inner: null, hasRows: false, nameWidth: 0, dots: [], card: true }
  }));
  const bracket = { x: SIDE + grid2.w + 8, y: HEAD2 - ARM, w: BRACKET, h: grid2.h + 2 * ARM };
  const ways = waysOf(node);
  const from = bracket.x + BRACKET;
  const longest2 = Math.max(0, ...ways.map((way) => measure(way.text, 9, true)));
  const pills = [];
  const edges = [];
  const outcomes = [...new Set(ways.map((way) => way.outcome))];
  let w5 = from + SIDE;
  const h5 = HEAD2 + grid2.h + (outer === "DOWN" ? 34 : 20);
  const heightOf = (i4) => HEAD2 + (i4 + 0.5) * grid2.h / ways.length;
  const lanes = /* @__PURE__ */ new Map();
  for (const [i4, way] of ways.entries()) {
    const known2 = lanes.get(way.outcome);
    if (known2) known2.ways.push(i4);
    else lanes.set(way.outcome, { x: 0, y: heightOf(i4), ways: [i4] });
  }
  let lane = from + longest2 + 24;
  for (const outcome of outcomes) {
    const at = lanes.get(outcome);
    if (!at) continue;
    const wide = pillWidth2(outcome);
    at.x = outer === "DOWN" ? lane + wide / 2 : lane;
    lane += outer === "DOWN" ? wide + 12 : 10;
  }
  if (ways.length)
    w5 = outer === "DOWN" ? lane : lane + 14 + (outer === null ? Math.max(...outcomes.map(pillWidth2)) : 0);
  for (const [outcome, at] of lanes) {
    const wide = pillWidth2(outcome) + (outer === null ? 4 : 0);
    const pill = outer === "DOWN" ? { x: at.x - wide / 2, y: h5 - PILL_H / 2, w: wide, h: PILL_H } : { x: outer === null ? w5 - wide - SIDE / 2 : w5 - wide / 2, y: at.y - PILL_H / 2, w: wide, h: PILL_H };
    pills.push({ ...pill, outcome });
    for (const i4 of at.ways) {
      const y5 = heightOf(i4);
      const corner = { x: at.x, y: y5 };
      const end = outer === "DOWN" ? { x: at.x, y: pill.y } : { x: pill.x, y: at.y };
      const points2 = outer !== "DOWN" && y5 !== at.y ? [corner, { x: at.x, y: at.y }] : outer === "DOWN" ? [corner] : [];
      const { link: link2, join: join2, source, outcomes: its, also, text: text2 } = ways[i4];
      edges.push({
        ...{ kind: "link", link: link2, join: join2, source, outcomes: its, also },
        points: [{ x: from, y: y5 }, ...points2, end],
        labels: [{ x: from + 8 + measure(text2, 9, true) / 2, y: y5 - 14, text: text2 }]
      });
    }
  }
  const entry = outer === "DOWN" ? { x: SIDE + 6, y: 0 } : outer === "RIGHT" ? { x: 0, y: HEAD2 / 2 } : null;
  const ports = pills.map((pill) => ({ ...pill, entry: false }));
  return {
    ...{ node, shape: { dir: "DOWN", columns: grid2.columns, cards: true }, w: w5, h: h5, boxes, pills, edges, entry },
    joins: ways.length ? [{ ...bracket, join: node.joins[0] ?? null }] : [],
    ports: entry ? [...ports, { x: entry.x - ENTRY / 2, y: entry.y - ENTRY / 2, w: ENTRY, h: ENTRY, entry: true, outcome: "" }] : []
  };
}

// src/drawing/elk.ts
var Elk = class {
  worker;
  ready;
  #calls = /* @__PURE__ */ new Map();
  #count = 0;
  constructor(worker) {
    this.worker = worker;
    worker.onmessage = ({ data }) => {
      const call = this.#calls.get(data.id);
      this.#calls.delete(data.id);
      if (!call) return;
      if (data.error) call.fail(new Error(data.error.message ?? String(data.error)));
      else call.done(data.data);
    };
    worker.onerror = (e4) => {
      for (const { fail } of this.#calls.values()) fail(new Error(e4.message || "its worker could not start"));
      this.#calls.clear();
    };
    this.ready = this.#ask({ cmd: "register", algorithms: ["layered"] });
    this.ready.catch(() => {
    });
  }
  async layout(graph) {
    await this.ready;
    return await this.#ask({ cmd: "layout", graph, layoutOptions: {}, options: {} });
  }
  #ask(message) {
    const id = this.#count++;
    return new Promise((done, fail) => {
      this.#calls.set(id, { done, fail });
      this.worker.postMessage({ id, ...message });
    });
  }
};

// src/drawing/shapes.ts
var GRID_FROM = 4;
var FOLD_FROM = { closed: 5, open: 7 };
var BUNDLE_FROM = 6;
var FOLD_COST = 1.05;
var nameOf = ({ dir, columns, folded }) => `${dir}${columns ?? ""}${folded ? "~" : ""}`;
function shapesOf(node, inner, aspect) {
  const shapes = DIRECTIONS.map((dir) => ({ dir }));
  const { children } = node;
  if (node.kind !== "concurrence") {
    if (children.length >= (inner.size ? FOLD_FROM.open : FOLD_FROM.closed))
      shapes.push(...DIRECTIONS.map((dir) => ({ dir, folded: true })));
    return shapes;
  }
  if (children.length < GRID_FROM) return shapes;
  const sizes = children.map((child) => inner.get(child.label) ?? { w: leafWidth(child), h: LEAF_H });
  const size = (columns2) => {
    let [w5, h5] = [0, 0];
    for (let i4 = 0; i4 < sizes.length; i4 += columns2) {
      const row = sizes.slice(i4, i4 + columns2);
      w5 = Math.max(
        w5,
        row.reduce((sum, one) => sum + one.w + 30, 0)
      );
      h5 += Math.max(...row.map((one) => one.h)) + 40;
    }
    return { w: w5, h: h5 };
  };
  const columns = children.map((_5, i4) => i4 + 1).slice(1, -1);
  const best = columns.reduce((a5, b3) => cost(size(b3), aspect) < cost(size(a5), aspect) ? b3 : a5);
  return [...shapes, { dir: "DOWN", columns: best }];
}
var badness = (layout, aspect) => cost(layout, aspect) * (layout.shape.folded ? FOLD_COST : 1);
var cost = ({ w: w5, h: h5 }, aspect) => Math.max(w5, aspect * h5) + 0.15 * Math.sqrt(w5 * h5);
function bundlesOf({ kind, links, children }) {
  if (kind === "plan" || kind === "concurrence" || children.length < BUNDLE_FROM) return /* @__PURE__ */ new Map();
  const groups = /* @__PURE__ */ new Map();
  for (const link2 of links) {
    if (!link2.to_outcome || link2.join !== null || link2.change || link2.note) continue;
    const key = [link2.target, ...link2.outcomes].join(SEP);
    groups.set(key, [...groups.get(key) ?? [], link2]);
  }
  const bundles = [...groups.values()].filter((group) => group.length >= BUNDLE_FROM);
  return new Map(bundles.flatMap((group) => group.map((link2) => [link2, group.length])));
}
var hasOver = (node, limit) => {
  const drawn = node.links.length - bundlesOf(node).size;
  return drawn > limit.links && drawn > limit.perState * node.children.length;
};

// src/drawing/overview.ts
var TILE_GAP = 6;
var HEAD3 = 24;
var HEAD_GROWS = 1.7;
var MOST_COLUMNS2 = 60;
function overview(node, open, aspect) {
  const tiles = node.children.map((child) => {
    const inner = isOpen(child, open) ? overview(child, open, aspect) : null;
    return { node: child, inner, w: inner?.w ?? leafWidth(child), h: inner?.h ?? LEAF_H };
  });
  const head2 = HEAD_GROWS * Math.max(HEAD3 / HEAD_GROWS, ...tiles.map((tile) => tile.inner?.head ?? 0));
  const least = measure(node.shown, 11, true) * (head2 / HEAD3) + 40;
  const tried = tiles.slice(0, MOST_COLUMNS2).map((_5, i4) => inRows(tiles, i4 + 1, head2, least));
  const best = tried.reduce((a5, b3) => cost(b3, aspect) < cost(a5, aspect) ? b3 : a5);
  const none = { pills: [], joins: [], ports: [], edges: [], entry: null };
  return { node, shape: { dir: "DOWN" }, ...best, ...none, head: head2, isOverview: true };
}
function inRows(tiles, columns, head2, least) {
  let [y5, w5] = [head2, least];
  const boxes = [];
  for (let i4 = 0; i4 < tiles.length; i4 += columns) {
    const row = tiles.slice(i4, i4 + columns);
    let x3 = TILE_GAP;
    for (const tile of row) {
      boxes.push({ ...tile, x: x3, y: y5, hasRows: false, nameWidth: 0, dots: [] });
      x3 += tile.w + TILE_GAP;
    }
    w5 = Math.max(w5, x3);
    y5 += Math.max(...row.map((tile) => tile.h)) + TILE_GAP;
  }
  return { boxes, w: w5, h: y5 };
}

// src/drawing/plan.ts
var ROW_H = 14;
var PILL_H2 = 15;
var ENTRY2 = 10;
var BAR = 6;
var DENSE = { links: 48, perState: 4 };
var FLOW = {
  DOWN: { out: "SOUTH", in: "NORTH" },
  RIGHT: { out: "EAST", in: "WEST" }
};
var SPACING = {
  "elk.spacing.nodeNode": "18",
  "elk.spacing.edgeNode": "11",
  "elk.spacing.edgeEdge": "9",
  "elk.layered.spacing.edgeNodeBetweenLayers": "8",
  "elk.layered.spacing.edgeEdgeBetweenLayers": "7",
  "elk.spacing.edgeLabel": "3",
  "elk.spacing.portPort": "10",
  "elk.spacing.componentComponent": "22"
};
var Plan = class {
  node;
  shape;
  dir;
  outer;
  id;
  inner;
  hasRows;
  outcomes;
  graph;
  entry;
  ends;
  targets;
  bars;
  bundled;
  // transitions without an arrow of their own, with the size of their bundle
  meanings = /* @__PURE__ */ new Map();
  #count = 0;
  /**
   * @param shape its own
   * @param outer direction of the container around it; null for the root
   * @param inner by label
   * @param aspect aspect of the view, for folding
   */
  constructor(node, shape, outer, id, inner, aspect) {
    this.node = node;
    this.shape = shape;
    const { dir } = shape;
    this.dir = dir;
    this.outer = outer;
    this.id = id;
    this.inner = inner;
    this.hasRows = dir === "RIGHT";
    this.bundled = bundlesOf(node);
    this.outcomes = this.#shownOutcomes();
    this.graph = this.#frame();
    if (shape.columns)
      Object.assign(this.graph.layoutOptions, {
        "elk.partitioning.activate": "true",
        "elk.layered.nodePlacement.strategy": "SIMPLE",
        // rows are placed below each other
        "elk.separateConnectedComponents": "false"
      });
    if (shape.folded)
      Object.assign(this.graph.layoutOptions, {
        "elk.layered.wrapping.strategy": "MULTI_EDGE",
        "elk.aspectRatio": String(aspect)
      });
    this.entry = this.#entry();
    this.ends = new Map(node.children.map((child) => [child.label, this.#child(child)]));
    this.targets = new Map(this.outcomes.map((outcome) => [outcome, this.#outcome(outcome)]));
    this.bars = node.joins.map((join2) => this.#join(join2));
    if (shape.columns) this.#makeRows(shape.columns);
    this.#edges();
  }
  #next(meaning) {
    const id = `${this.id}.${this.#count++}`;
    this.meanings.set(id, meaning);
    return id;
  }
  #shownOutcomes() {
    const used = new Set(this.node.links.filter((link2) => link2.to_outcome).map((link2) => link2.target));
    if (this.outer !== null) {
      for (const pill of this.node.pills) used.add(pill.outcome);
      for (const outcome of this.node.wired ?? []) used.add(outcome);
    }
    return this.node.outcomes.filter((outcome) => used.has(outcome));
  }
  #frame() {
    const { node, dir, outer } = this;
    const tag = { concurrence: 66, iterator: 52, sequence: 60 }[node.kind] ?? 8;
    const pill = Math.max(0, ...this.outcomes.map(pillWidth));
    const name = measure(node.shown, 11, true) + tag + 30;
    const title = outer === "DOWN" ? 2 * name - 20 : name;
    const right = outer === "RIGHT" ? 14 + pill / 2 : 14;
    const bottom = outer === "DOWN" ? 20 : 14;
    return {
      id: this.id,
      children: [],
      edges: [],
      ports: [],
      labels: [{ text: node.shown, width: title, height: 17 }],
      layoutOptions: {
        ...SPACING,
        "elk.algorithm": "layered",
        "elk.direction": dir,
        "elk.edgeRouting": "ORTHOGONAL",
        "elk.hierarchyHandling": "SEPARATE_CHILDREN",
        "elk.padding": `[top=14,left=14,bottom=${bottom},right=${right}]`,
        "elk.layered.spacing.nodeNodeBetweenLayers": dir === "DOWN" ? "12" : "22",
        // The simplex method makes more arrows straight, but takes minutes if twelve states all lead to each other.
        "elk.layered.nodePlacement.strategy": hasOver(node, DENSE) ? "BRANDES_KOEPF" : "NETWORK_SIMPLEX",
        "elk.layered.nodePlacement.favorStraightEdges": "true",
        "elk.layered.considerModelOrder.strategy": "NODES_AND_EDGES",
        // A plan lists all places before all transitions: in that order half of its arcs would point back.
        "elk.layered.cycleBreaking.strategy": node.kind === "plan" ? "DEPTH_FIRST" : "MODEL_ORDER",
        "elk.layered.edgeLabels.sideSelection": "SMART_DOWN",
        "elk.nodeLabels.placement": "[H_CENTER, V_TOP, INSIDE]",
        "elk.nodeSize.constraints": "[NODE_LABELS, PORTS, PORT_LABELS, MINIMUM_SIZE]",
        "elk.portConstraints": "FIXED_SIDE"
      }
    };
  }
  #entry() {
    const id = this.#next({ kind: "entry" });
    if (this.outer === null)
      this.graph.children.push({
        id,
        width: 9,
        height: 9,
        layoutOptions: { "elk.layered.layering.layerConstraint": "FIRST" }
      });
    else
      this.graph.ports.push({
        id,
        width: ENTRY2,
        height: ENTRY2,
        layoutOptions: { "elk.port.side": FLOW[this.outer].in, "elk.port.borderOffset": String(-ENTRY2 / 2) }
      });
    return id;
  }
  #child(child) {
    const inner = this.inner.get(child.label);
    return inner ? this.#openChild(child, inner) : this.#leaf(child);
  }
  #openChild(child, inner) {
    const out = /* @__PURE__ */ new Map();
    const id = this.#next({ kind: "open", child, inner });
    let entry = id;
    const ports = inner.ports.map((p5) => {
      const port = this.#next({ kind: "port" });
      if (p5.entry) entry = port;
      else out.set(p5.outcome, port);
      const offset = p5.entry ? -ENTRY2 / 2 : this.dir === "DOWN" ? -p5.h / 2 : -p5.w / 2;
      const side = FLOW[this.dir][p5.entry ? "in" : "out"];
      return {
        id: port,
        x: p5.x,
        y: p5.y,
        width: p5.w,
        height: p5.h,
        layoutOptions: { "elk.port.side": side, "elk.port.borderOffset": String(offset) }
      };
    });
    this.graph.children.push({
      id,
      width: inner.w,
      height: inner.h,
      ports,
      layoutOptions: { "elk.portConstraints": "FIXED_POS" }
    });
    return { entry, out: (outcome) => out.get(outcome ?? "") ?? id, split: true };
  }
  #leaf(child) {
    const width = leafWidth(child);
    if (!this.hasRows || !child.wired.length) {
      const id2 = this.#next({ kind: "leaf", child, hasRows: false, nameWidth: 0 });
      this.graph.children.push({ id: id2, width, height: LEAF_H });
      return { entry: id2, out: () => id2, split: false };
    }
    const text2 = Math.max(...child.wired.map((outcome) => measure(shorten(outcome), 9))) + 16;
    const single = child.wired.length === 1;
    const h5 = single ? LEAF_H : Math.max(LEAF_H, 10 + child.wired.length * ROW_H);
    const w5 = width - 4 + text2;
    const id = this.#next({ kind: "leaf", child, hasRows: true, nameWidth: width });
    const top = (h5 - child.wired.length * ROW_H) / 2;
    const out = /* @__PURE__ */ new Map();
    const ports = child.wired.map((outcome, i4) => {
      const port = this.#next({ kind: "dot", outcome });
      out.set(outcome, port);
      return {
        id: port,
        x: w5 - 3.5,
        y: single ? h5 / 2 - 3.5 : top + i4 * ROW_H + 3.5,
        width: 7,
        height: 7,
        layoutOptions: { "elk.port.side": "EAST", "elk.port.borderOffset": "-3.5" }
      };
    });
    this.graph.children.push({
      id,
      width: w5,
      height: h5,
      ports,
      layoutOptions: { "elk.portConstraints": "FIXED_POS" }
    });
    return { entry: id, out: (outcome) => out.get(outcome ?? "") ?? id, split: true };
  }
  #outcome(outcome) {
    const from = [...this.bundled].find(([link2]) => link2.target === outcome)?.[1];
    const w5 = pillWidth(from ? `${outcome}, from ${from}` : outcome) + (this.outer === null ? 4 : 0);
    const id = this.#next({ kind: "pill", outcome, from });
    if (this.outer === null)
      this.graph.children.push({
        id,
        width: w5,
        height: 18,
        layoutOptions: { "elk.layered.layering.layerConstraint": "LAST" }
      });
    else {
      const offset = this.outer === "DOWN" ? -PILL_H2 / 2 : -w5 / 2;
      this.graph.ports.push({
        id,
        width: w5,
        height: PILL_H2,
        layoutOptions: { "elk.port.side": FLOW[this.outer].out, "elk.port.borderOffset": String(offset) }
      });
    }
    return id;
  }
  /** Arrange children in rows, with entry above and joins and outcomes below. */
  #makeRows(columns) {
    const rows = Math.ceil(this.node.children.length / columns);
    let i4 = 0;
    for (const one of this.graph.children) {
      const kind = this.meanings.get(one.id)?.kind ?? "";
      const row = { entry: 0, join: rows + 1, pill: rows + 2 }[kind];
      one.layoutOptions = {
        ...one.layoutOptions,
        "elk.partitioning.partition": String(row ?? 1 + Math.floor(i4++ / columns))
      };
    }
  }
  #join(join2) {
    const id = this.#next({ kind: "join", join: join2 });
    const long = 12 + 12 * join2.conditions.length;
    const [width, height] = this.dir === "DOWN" ? [long, BAR] : [BAR, long];
    this.graph.children.push({ id, width, height });
    return id;
  }
  #edges() {
    const { node } = this;
    for (const label of node.initial) {
      const kind = node.kind === "concurrence" ? "fork" : "initial";
      const target = this.ends.get(label);
      if (target && !this.shape.columns) this.#edge({ kind, source: "", outcomes: [] }, this.entry, target.entry);
    }
    for (const link2 of node.links) {
      if (this.bundled.has(link2)) continue;
      const source = this.ends.get(link2.source);
      const outcome = link2.join === null ? this.targets.get(link2.target) : this.bars[link2.join];
      const target = link2.to_outcome ? outcome : this.ends.get(link2.target)?.entry;
      if (!source || !target) continue;
      const meaning = { kind: "link", link: link2, source: `${node.path}/${link2.source}` };
      if (source.split)
        for (const outcome2 of link2.outcomes)
          this.#edge({ ...meaning, outcomes: [outcome2] }, source.out(outcome2), target);
      else {
        const plain = link2.to_outcome && link2.join === null && link2.outcomes.length === 1 && link2.outcomes[0] === link2.target;
        this.#edge({ ...meaning, outcomes: link2.outcomes }, source.out(), target, plain ? [] : link2.outcomes);
      }
    }
    for (const [i4, join2] of node.joins.entries()) {
      const target = this.targets.get(join2.outcome);
      const meaning = { kind: "link", join: join2, source: node.path, outcomes: [join2.outcome] };
      if (target) this.#edge(meaning, this.bars[i4], target, [joinText(join2, join2.need - 1)]);
    }
    if (this.bundled.size || this.shape.folded && this.outer !== null) this.#reachOutcomes();
  }
  /** Lead an invisible line to each port without one: ELK cannot fold a container with an unconnected port. */
  #reachOutcomes() {
    const reached = new Set(this.graph.edges.map((edge) => edge.targets[0]));
    const last = this.graph.children[this.graph.children.length - 1];
    for (const target of this.targets.values())
      if (!reached.has(target)) this.#edge({ kind: "hidden" }, last.id, target);
  }
  #edge(meaning, source, target, labels = []) {
    this.graph.edges.push({
      id: this.#next(meaning),
      sources: [source],
      targets: [target],
      labels: labels.map((text2) => ({ text: text2, width: measure(shorten(text2), 9) + 6, height: 12 }))
    });
  }
};

// src/drawing/results.ts
function placed(plan, found) {
  const result = {
    node: plan.node,
    shape: plan.shape,
    w: found.width ?? 0,
    h: found.height ?? 0,
    boxes: [],
    pills: [],
    joins: [],
    ports: [],
    edges: [],
    entry: null
  };
  for (const port of found.ports ?? []) {
    const meaning = plan.meanings.get(port.id);
    const place = boxOf(port);
    const outcome = meaning?.kind === "pill" ? meaning.outcome : "";
    result.ports.push({ ...place, entry: meaning?.kind === "entry", outcome });
    if (meaning?.kind === "entry") result.entry = { x: place.x + 5, y: place.y + 5 };
    else result.pills.push({ ...place, outcome, from: meaning?.kind === "pill" ? meaning.from : void 0 });
  }
  for (const child of found.children) {
    const meaning = plan.meanings.get(child.id);
    const place = boxOf(child);
    if (meaning?.kind === "entry") result.entry = { x: place.x + 4.5, y: place.y + 4.5 };
    else if (meaning?.kind === "join") result.joins.push({ ...place, join: meaning.join });
    else if (meaning?.kind === "pill") result.pills.push({ ...place, outcome: meaning.outcome, from: meaning.from });
    else if (meaning?.kind === "open") {
      const { child: node, inner } = meaning;
      result.boxes.push({ ...place, node, inner, hasRows: false, nameWidth: 0, dots: [] });
    } else if (meaning?.kind === "leaf") {
      const { child: node, hasRows, nameWidth } = meaning;
      result.boxes.push({ ...place, node, inner: null, hasRows, nameWidth, dots: hasRows ? dotsOf(child, plan) : [] });
    }
  }
  for (const edge of found.edges) {
    const meaning = plan.meanings.get(edge.id);
    if (meaning.kind === "hidden") continue;
    for (const section of edge.sections ?? [])
      result.edges.push({
        ...meaning,
        points: [section.startPoint, ...section.bendPoints ?? [], section.endPoint],
        labels: (edge.labels ?? []).map(({ x: x3 = 0, y: y5 = 0, width = 0, text: text2 = "" }) => ({ x: x3 + width / 2, y: y5, text: text2 }))
      });
  }
  return result;
}
var boxOf = ({ x: x3 = 0, y: y5 = 0, width: w5 = 0, height: h5 = 0 }) => ({ x: x3, y: y5, w: w5, h: h5 });
var dotsOf = (child, plan) => (child.ports ?? []).flatMap((port) => {
  const { x: x3, y: y5 } = boxOf(port);
  const meaning = plan.meanings.get(port.id);
  return meaning?.kind === "dot" ? [{ x: x3 + 3.5, y: y5 + 3.5, outcome: meaning.outcome }] : [];
});
var isSound = ({ edges }) => edges.every(
  ({ points: points2 }) => points2.every(
    ({ x: x3, y: y5 }, i4) => i4 === 0 || Math.min(Math.abs(x3 - points2[i4 - 1].x), Math.abs(y5 - points2[i4 - 1].y)) < 1
  )
);

// src/drawing/layout.ts
var MOST_CACHED = 2e3;
var OVERVIEW_FROM = 150;
var TANGLED = { links: 100, perState: 6 };
var INNER_ASPECTS = [1, 0.5, 2];
var TRIED_UNTIL = 80;
var ASPECTS = { least: 0.6, most: 5 };
var SAME_ASPECT = 0.15;
var within2 = (aspect) => Math.max(ASPECTS.least, Math.min(ASPECTS.most, aspect));
var Layout = class {
  elk;
  /** By container, open containers in it, its direction and that of the container around it. */
  cache = /* @__PURE__ */ new Map();
  chosen = /* @__PURE__ */ new Map();
  // shapes of the containers shown, kept so that the picture stays stable
  tried = /* @__PURE__ */ new Map();
  // names of the shapes of a container, by the open containers in it
  aspect = 1.6;
  // of the room in the view: its width divided by its height
  inner = 1;
  // factor on it, for inner containers
  constructor(worker) {
    this.elk = new Elk(worker);
  }
  clear() {
    this.forget();
    this.choose(this.aspect);
  }
  /** Choose the shapes anew for a view of that aspect. */
  choose(aspect) {
    this.chosen.clear();
    const next = within2(aspect);
    if (Math.abs(next - this.aspect) > 0.1 * this.aspect) this.forget();
    this.aspect = next;
  }
  /** Whether the shapes were chosen for a view of about that aspect. */
  suits(aspect) {
    return Math.abs(Math.log(within2(aspect) / this.aspect)) < SAME_ASPECT;
  }
  /** Forget the layouts, but keep the shapes. */
  forget() {
    this.cache.clear();
    this.tried.clear();
  }
  /**
   * Lay out everything below `root`, with the containers of `open` opened.
   * @param onProgress called with the number of states that are laid out
   * @param asTiles whether states are to be tiles without arrows, however few they are
   * @throws ELK fails for the root; a container inside for which it fails is shown closed
   */
  async run(root, open, onProgress, asTiles = false) {
    const all = countOf(root, open);
    if (asTiles || all > OVERVIEW_FROM || isTangled(root, open)) return overview(root, open, this.aspect);
    if (this.cache.size > MOST_CACHED) this.forget();
    const levels = [];
    const height = (node) => {
      if (!isOpen(node, open)) return -1;
      const h5 = 1 + Math.max(-1, ...node.children.map(height));
      levels[h5] ??= [];
      levels[h5].push(node);
      return h5;
    };
    if (height(root) < 0) return null;
    const isSettled = this.chosen.has(root.path) || all > TRIED_UNTIL || levels.length < 2;
    let best = null;
    for (const inner of isSettled ? [1] : INNER_ASPECTS) {
      this.inner = inner;
      const keys2 = /* @__PURE__ */ new Map();
      for (const node of levels.flat()) keys2.set(node, keyOf2(node, open, keys2, inner));
      let done = 0;
      for (const level of levels) {
        await this.#layOut(level, root, open, keys2);
        done += level.reduce((sum, node) => sum + node.children.length, 0);
        onProgress?.(done, all);
      }
      const found = this.#best(root, null, keys2);
      if (found && (!best || badness(found, this.aspect) < badness(best, this.aspect))) best = found;
    }
    this.inner = 1;
    if (!best) throw new Error(`ELK fails at every layout of ${root.name}`);
    this.#settle(best);
    return best;
  }
  async #layOut(level, root, open, keys2) {
    const plans = [];
    for (const node of level) {
      const known2 = keys2.get(node) ?? "";
      if (areCards(node, open)) {
        for (const outer of node === root ? [null] : DIRECTIONS)
          this.cache.set(known2 + SEP + CARDS + SEP + outer, cards(node, outer, this.aspect));
        this.tried.set(known2, [CARDS]);
        continue;
      }
      const names = new Set(this.tried.get(known2));
      const chosen2 = this.chosen.get(node.path);
      for (const outer of node === root ? [null] : DIRECTIONS)
        for (const shape of shapesOf(node, this.#inside(node, open, keys2, "DOWN"), this.aspect)) {
          const name = nameOf(shape);
          if (chosen2 !== void 0 && chosen2 !== name) continue;
          names.add(name);
          const key = known2 + SEP + name + SEP + outer;
          if (this.cache.has(key)) continue;
          const inner = this.#inside(node, open, keys2, shape.dir);
          plans.push({ key, plan: new Plan(node, shape, outer, `g${plans.length}`, inner, this.aspect) });
        }
      this.tried.set(known2, [...names]);
    }
    if (!plans.length) return;
    const isComplete = await this.#place(plans);
    if (isComplete) return;
    const laid = new Set(plans.filter(({ key }) => this.cache.has(key)).map(({ plan }) => plan.node));
    const stuck = level.filter((node) => this.chosen.has(node.path) && !laid.has(node));
    for (const node of stuck) this.chosen.delete(node.path);
    if (stuck.length) await this.#layOut(stuck, root, open, keys2);
  }
  /**
   * Let ELK lay out some plans. It fails for some graphs, and folds others wrongly: these are left out. Returns whether
   * it did all of them.
   */
  async #place(plans) {
    const batch = (some) => this.elk.layout({
      id: "batch",
      layoutOptions: { "elk.algorithm": "fixed" },
      children: some.map(({ plan }) => plan.graph),
      edges: []
    });
    try {
      const result = await batch(plans);
      const layouts = plans.map(({ plan }, i4) => placed(plan, result.children[i4]));
      for (const [i4, { key }] of plans.entries()) if (isSound(layouts[i4])) this.cache.set(key, layouts[i4]);
      return layouts.every(isSound);
    } catch (error) {
      if (plans.length === 1) {
        console.warn(`no layout of ${plans[0].plan.node.path}: ${error}`);
        return false;
      }
      for (const one of plans) await this.#place([one]);
      return false;
    }
  }
  /** The layouts of the open containers in a container, by label. */
  #inside(node, open, keys2, dir) {
    const inner = /* @__PURE__ */ new Map();
    for (const child of node.children) if (isOpen(child, open)) inner.set(child.label, this.#best(child, dir, keys2));
    return inner;
  }
  #best(node, outer, keys2) {
    let best = null;
    const known2 = keys2.get(node) ?? "";
    const chosen2 = this.chosen.get(node.path);
    const names = this.tried.get(known2) ?? [];
    const aspect = outer === null ? this.aspect : this.aspect * this.inner;
    for (const name of chosen2 !== void 0 && names.includes(chosen2) ? [chosen2] : names) {
      const one = this.cache.get(known2 + SEP + name + SEP + outer);
      if (one && (!best || badness(one, aspect) < badness(best, aspect))) best = one;
    }
    return best;
  }
  /** Keep the shapes of the containers shown. */
  #settle(result) {
    if (!result.shape.cards) this.chosen.set(result.node.path, nameOf(result.shape));
    for (const child of result.boxes) if (child.inner) this.#settle(child.inner);
  }
};
var isTangled = (node, open) => isOpen(node, open) && (hasOver(node, TANGLED) || node.children.some((child) => isTangled(child, open)));
var countOf = (node, open) => isOpen(node, open) ? node.children.reduce((sum, child) => sum + countOf(child, open), 1) : 1;
var CARDS = "cards";
var areCards = (node, open) => hasManyBranches(node) && !node.children.some((child) => isOpen(child, open) || child.change);
function keyOf2(node, open, keys2, inner) {
  const inside2 = node.children.filter((child) => isOpen(child, open)).map((child) => keys2.get(child));
  return `${node.path}(${inside2.join(SEP)})${inside2.length && inner !== 1 ? inner : ""}`;
}

// src/drawing/layout_controller.ts
var OPENING_MS = 15e3;
var READABLE3 = 0.75;
var TILES_MS = 100;
var SLOW_MS = 300;
var LARGEST = 1.5;
var LayoutController = class {
  diagram;
  minimap;
  view;
  painter;
  layout = null;
  running = null;
  ms = 0;
  // duration of the last layout
  openedAt = 0;
  // time of the machine's arrival [ms]
  fitted = null;
  // the view that showed everything
  #again = false;
  #isNew = true;
  // whether ELK has laid out nothing of the machine yet
  #tiles;
  /** What to show after it. */
  #after = { frame: false, focus: null };
  #toggled = null;
  // path of the container that is being opened or closed
  #follow = new Follow();
  constructor(diagram, minimap2, view2, painter) {
    this.diagram = diagram;
    this.minimap = minimap2;
    this.view = view2;
    this.painter = painter;
  }
  /** @param worker of ELK */
  start(worker) {
    this.layout = new Layout(worker);
  }
  /** Another machine has come. */
  restart() {
    this.openedAt = performance.now();
    this.#isNew = true;
    this.#follow.restart();
    this.layout?.clear();
  }
  /** Lay out and draw the machine; then show all of it, the running states, or one state. */
  relayout({ frame = false, focus = null } = {}) {
    if (frame) this.#after.frame = frame;
    this.#after.focus = focus ?? this.#after.focus;
    if (this.running) this.#again = true;
    else this.running = this.#loop();
    return this.running;
  }
  async #loop() {
    try {
      do {
        this.#again = false;
        await this.#once();
        if (this.#after.frame === true && this.isOtherShape()) this.#again = true;
      } while (this.#again);
      this.#show();
      const { dataset } = document.documentElement;
      dataset.drawn = String(Number(dataset.drawn ?? 0) + 1);
      store.data.failure.value = null;
    } catch (error) {
      const text2 = `This machine could not be laid out: ${messageOf(error)}`;
      if (this.#isNew) {
        clearTimeout(this.#tiles);
        this.#drawTiles();
        store.data.failure.value = `${text2}. You see its states without their arrows.`;
      } else store.view.notify(text2, "error");
      console.error(error);
    } finally {
      this.running = null;
    }
  }
  async #once() {
    const model = store.data.model.value;
    if (!model || !this.layout) return;
    const begun = performance.now();
    if (this.#after.frame) this.layout.choose(this.view.aspect);
    const progress = (done, all) => {
      if (performance.now() - begun > SLOW_MS) store.view.laidOut.value = { done, all };
    };
    let open = new Set(store.view.opened.value).add(model.root.path);
    if (this.#isNew) this.#tiles = setTimeout(() => this.#drawTiles(), TILES_MS);
    let result = await this.layout.run(model.root, open, progress, store.view.outline.value);
    if (this.#after.frame === "follow")
      while (result && !isLegible(boxesOf(result), this.view)) {
        const less = oneLevelLess(open);
        if (!less) break;
        open = less;
        store.view.opened.value = less;
        result = await this.layout.run(model.root, less, progress);
      }
    store.view.laidOut.value = null;
    store.view.overview.value = Boolean(result?.isOverview);
    this.ms = performance.now() - begun;
    if (!result || model !== store.data.model.value) return;
    clearTimeout(this.#tiles);
    this.#isNew = false;
    const anchor = this.#anchor();
    this.diagram.draw(result, model, store.data.problems.value);
    this.minimap.draw(this.diagram.picture);
    this.#hold(anchor);
    this.painter.paintAll();
    const size = this.diagram.size;
    const tooSmall = size !== null && this.view.scaleFor(size) < READABLE3;
    if (this.#after.frame === true && tooSmall && store.view.openOneLevelLess()) this.#again = true;
  }
  /** Show the states as tiles without arrows, for which no ELK is needed: it takes seconds to begin. */
  #drawTiles() {
    const model = store.data.model.value;
    if (!model || !this.#isNew) return;
    const open = new Set(store.view.opened.value).add(model.root.path);
    this.diagram.draw(overview(model.root, open, this.view.aspect), model, store.data.problems.value);
    this.minimap.draw(this.diagram.picture);
    this.painter.paintAll();
    this.fit({ animate: false });
  }
  /** Bring into view what was asked for. */
  #show() {
    const { frame, focus } = this.#after;
    const { size } = this.diagram;
    this.#after = { frame: false, focus: null };
    if (focus) this.focus(focus);
    else if (frame === "follow" && size) this.view.frame(boxToFrame(this.diagram, this.view, size), { most: LARGEST });
    else if (frame) this.fit({ animate: false });
  }
  /** The state in the middle of the view, and its place: it keeps it while a layout moves the others. */
  #anchor() {
    const { view: view2, diagram } = this;
    if (!diagram.size) return null;
    const x3 = (view2.width / 2 - view2.x) / view2.k;
    const y5 = (view2.height / 2 - view2.y) / view2.k;
    const inside2 = (b3) => x3 >= b3.x && x3 <= b3.x + b3.w && y5 >= b3.y && y5 <= b3.y + b3.h;
    const path = this.#toggled ?? [...diagram.picture.boxes].findLast(([, box2]) => inside2(box2))?.[0] ?? null;
    this.#toggled = null;
    const box = diagram.boxOf(path);
    return path !== null && box ? { path, x: box.x, y: box.y } : null;
  }
  #hold(anchor) {
    const box = anchor && this.diagram.boxOf(anchor.path);
    if (!box) return;
    const { x: x3, y: y5, k: k4 } = this.view;
    this.view.set(x3 - (box.x - anchor.x) * k4, y5 - (box.y - anchor.y) * k4, k4);
  }
  // -- what is in view --------------------------------------------------------------------------
  focus(path) {
    const box = this.diagram.boxOf(path);
    if (box) this.view.frame(box, { margin: 110, most: Math.max(1, Math.min(this.view.k, LARGEST)) });
  }
  fit({ animate = true } = {}) {
    if (this.diagram.size) this.fitted = this.view.frame(this.diagram.size, { animate, most: LARGEST });
  }
  /** Show everything, with a layout for the present size of the view. */
  refit() {
    this.relayout({ frame: true });
  }
  /**
   * Show everything again after the view was resized, if it did before. Panels that appear while the page opens change
   * its aspect, so the machine is laid out for the new one.
   */
  resized() {
    if (this.fitted && this.view.is(this.fitted)) {
      if (this.isOtherShape()) this.refit();
      else this.fit({ animate: false });
    }
    this.minimap.showWindow(this.view);
  }
  /** Whether the page is just opening and the aspect of its view has changed much since the layout. */
  isOtherShape() {
    const isOpening = performance.now() - this.openedAt < OPENING_MS;
    return isOpening && this.layout !== null && !this.layout.suits(this.view.aspect);
  }
  // -- the open containers ----------------------------------------------------------------------
  /** Open or close a container, unless it is the root. */
  toggle(path) {
    const node = store.data.model.value?.get(path);
    if (store.view.overview.value && node) {
      store.view.openAround(node);
      this.relayout({ focus: node.path });
      return;
    }
    if (!node?.children.length || !node.parent) return;
    this.#toggled = node.path;
    store.view.toggle(node.path);
    this.relayout();
  }
  setDepth(levels) {
    const model = store.data.model.value;
    if (!model) return;
    store.view.follow.value = false;
    store.view.setOpened(model.toDepth(levels));
    this.relayout({ frame: true });
  }
  /** Show the outermost level with larger names: with its arrows, then as tiles without; or show the arrows again. */
  toggleOutline() {
    const { view: view2 } = store;
    if (view2.opened.value.size > 1) {
      this.setDepth(1);
      return;
    }
    view2.follow.value = false;
    view2.outline.value = !view2.outline.value;
    this.refit();
  }
  setImplicit(on2) {
    store.view.setImplicit(on2);
    this.layout?.clear();
    this.relayout();
  }
  setFollow(on2) {
    store.view.follow.value = on2;
    store.view.outline.value = false;
    this.#follow.restart();
    this.follow();
  }
  /** In follow mode, open the containers that run and frame what runs in them. */
  follow() {
    if (!store.view.follow.value || this.running) return;
    const open = this.#follow.containersToOpen(store.playback.nowMs());
    if (!open) return;
    store.view.opened.value = open;
    this.relayout({ frame: "follow" });
  }
};

// src/drawing/floor.ts
var pixelOf = ({ k: k4, left, bottom }, { x: x3, y: y5 }) => [
  left + x3 * k4,
  bottom - y5 * k4
];
var placeAt = ({ k: k4, left, bottom }, px, py) => ({
  x: (px - left) / k4,
  y: (bottom - py) / k4
});
var Floor = class {
  #colours;
  #onPicture;
  /** pictures of maps, by their cells and colours */
  #pictures = /* @__PURE__ */ new Map();
  /** @param onPicture called when a map was unpacked that could not be drawn before */
  constructor(colours, onPicture) {
    this.#colours = colours;
    this.#onPicture = onPicture;
  }
  /** Make the pictures anew. */
  forget() {
    this.#pictures.clear();
  }
  /** @param ratio of device pixels to CSS pixels */
  draw(g5, map, scale, ratio) {
    const picture = this.#picture(map);
    if (!picture) return;
    const cell = scale.k * map.resolution;
    const [x3, y5] = pixelOf(scale, cellAt(map, 0, 0));
    g5.save();
    g5.translate(x3, y5);
    g5.rotate(-map.origin[2]);
    g5.scale(cell, cell);
    g5.imageSmoothingEnabled = cell * ratio < 2;
    g5.imageSmoothingQuality = "high";
    g5.drawImage(picture, 0, -map.height);
    g5.restore();
  }
  /** A map as a picture; null while it is being unpacked. */
  #picture(map) {
    const colours = ["floor", "wall", "unknown"].map((name) => this.#colours.of(name));
    const key = `${colours.join()} ${map.width} ${map.cells}`;
    const known2 = this.#pictures.get(key);
    if (known2) return known2.width ? known2 : null;
    const made = document.createElement("canvas");
    made.width = 0;
    this.#pictures.clear();
    this.#pictures.set(key, made);
    bytesOf(map.cells).then((cells) => {
      if (cells.length !== map.width * map.height) return;
      paintCells(made, map, cells, colours.map(wordOf2));
      this.#onPicture();
    }).catch(() => {
    });
    return null;
  }
  /** Draw a grid of 1 m. */
  drawGrid(g5, scale, width, height) {
    const step = scale.k > 6 ? 1 : 10;
    const from = placeAt(scale, 0, height);
    const to = placeAt(scale, width, 0);
    g5.strokeStyle = this.#colours.of("hair-map");
    g5.lineWidth = 1;
    g5.beginPath();
    for (let x3 = Math.ceil(from.x / step) * step; x3 < to.x; x3 += step) {
      const [px] = pixelOf(scale, { x: x3, y: 0 });
      g5.moveTo(px, 0);
      g5.lineTo(px, height);
    }
    for (let y5 = Math.ceil(from.y / step) * step; y5 < to.y; y5 += step) {
      const [, py] = pixelOf(scale, { x: 0, y: y5 });
      g5.moveTo(0, py);
      g5.lineTo(width, py);
    }
    g5.stroke();
  }
};
function paintCells(canvas2, { width, height }, cells, shades) {
  Object.assign(canvas2, { width, height });
  const g5 = canvas2.getContext("2d");
  const image = g5.createImageData(width, height);
  const words2 = new Uint32Array(image.data.buffer);
  for (let row = 0; row < height; row++)
    for (let i4 = 0, from = (height - 1 - row) * width; i4 < width; i4++)
      words2[row * width + i4] = shades[cells[from + i4]] ?? shades[2];
  g5.putImageData(image, 0, 0);
}
function wordOf2(hex) {
  const full = hex.length === 4 ? [...hex.slice(1)].map((c4) => c4 + c4).join("") : hex.slice(1, 7);
  const [r4, g5, b3] = [0, 2, 4].map((i4) => Number.parseInt(full.slice(i4, i4 + 2), 16));
  return (255 << 24 | b3 << 16 | g5 << 8 | r4) >>> 0;
}

// src/drawing/theme.ts
var FONT = "11px Inter, Arial, sans-serif";
var systemIsDark = matchMedia("(prefers-color-scheme: dark)");
var isDark = () => store.view.theme.value === "system" ? systemIsDark.matches : store.view.theme.value === "dark";
function applyTheme() {
  if (store.view.theme.value === "system") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = store.view.theme.value;
  save("theme", store.view.theme.value);
}
var Colours = class {
  #known = /* @__PURE__ */ new Map();
  of(name) {
    const known2 = this.#known.get(name);
    if (known2 !== void 0) return known2;
    const colour = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
    this.#known.set(name, colour);
    return colour;
  }
  /** Read them again. */
  forget() {
    this.#known.clear();
  }
};
function fitted(g5) {
  const { canvas: canvas2 } = g5;
  const [width, height] = [canvas2.clientWidth, canvas2.clientHeight];
  if (!width || !height) return null;
  const ratio = devicePixelRatio || 1;
  const [w5, h5] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas2.width !== w5 || canvas2.height !== h5) Object.assign(canvas2, { width: w5, height: h5 });
  g5.setTransform(ratio, 0, 0, ratio, 0, 0);
  return { width, height, ratio };
}

// src/drawing/labels.ts
var Labels = class {
  #g;
  #colours;
  #taken = [];
  constructor(g5, colours) {
    this.#g = g5;
    this.#colours = colours;
  }
  /** Begin a new picture. */
  forget() {
    this.#taken = [];
  }
  /** Keep names away from an area [px]. */
  keepFree(area) {
    this.#taken.push(area);
  }
  /** Write a name beside a place [px]. */
  write(text2, x3, y5, strong) {
    if (!text2) return;
    const g5 = this.#g;
    g5.font = strong ? `620 ${FONT}` : FONT;
    const wide = g5.measureText(text2).width;
    const sides = [
      [x3 + 12, y5],
      [x3 - 12 - wide, y5],
      [x3 - wide / 2, y5 + 16],
      [x3 - wide / 2, y5 - 16]
    ].map(([left, middle]) => ({ left, top: middle - 7, right: left + wide, bottom: middle + 7 }));
    const side = sides.find((one) => this.#isFree(one)) ?? sides[0];
    this.#taken.push(side);
    g5.textAlign = "left";
    g5.strokeStyle = this.#colours.of("floor");
    g5.lineWidth = 3;
    g5.lineJoin = "round";
    g5.strokeText(text2, side.left, side.top + 7);
    g5.fillStyle = this.#colours.of("ink");
    g5.fillText(text2, side.left, side.top + 7);
  }
  #isFree(a5) {
    const isInside = a5.left > 2 && a5.right < this.#g.canvas.clientWidth - 2;
    const meets = (b3) => a5.left < b3.right && b3.left < a5.right && a5.top < b3.bottom && b3.top < a5.bottom;
    return isInside && !this.#taken.some(meets);
  }
};

// src/drawing/viewport.ts
var LEAST_SCALE = 0.04;
var MOST_SCALE = 4;
var HEAD4 = 30;
var MARGIN = 16;
var Viewport = class {
  svg;
  world;
  onChange;
  reducedMotion;
  x = 0;
  y = 0;
  k = 1;
  moved = false;
  // whether the last press of the pointer moved the view
  #animation = 0;
  constructor(svg2, world, onChange) {
    this.svg = svg2;
    this.world = world;
    this.onChange = onChange;
    this.reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
    svg2.addEventListener("wheel", (e4) => this.#wheel(e4), { passive: false });
    grab(svg2, {
      onPress: () => {
        this.moved = false;
      },
      onPan: (dx, dy) => {
        this.moved = true;
        this.pan(dx, dy);
      },
      onZoom: (factor, px, py) => this.zoom(factor, px, py)
    });
  }
  get width() {
    return this.svg.clientWidth || 1;
  }
  get height() {
    return this.svg.clientHeight || 1;
  }
  /** Width divided by height of the room for a machine: in a low view the margins take much of it. */
  get aspect() {
    return Math.max(1, this.width - 2 * MARGIN) / Math.max(1, this.height - HEAD4 - 2 * MARGIN);
  }
  set(x3, y5, k4) {
    Object.assign(this, { x: x3, y: y5, k: k4 });
    this.onChange();
    this.world.setAttribute("transform", `translate(${x3} ${y5}) scale(${k4})`);
  }
  /** Show all of a box. */
  frame(box, { margin = MARGIN, most = 1.6, animate = true } = {}) {
    const room = this.height - HEAD4;
    const k4 = Math.min(most, (this.width - 2 * margin) / box.w, (room - 2 * margin) / box.h);
    const x3 = (this.width - box.w * k4) / 2 - box.x * k4;
    const y5 = HEAD4 + (room - box.h * k4) / 2 - box.y * k4;
    if (animate) this.animateTo(x3, y5, k4);
    else this.set(x3, y5, k4);
    return { x: x3, y: y5, k: k4 };
  }
  is({ x: x3, y: y5, k: k4 }) {
    return Math.abs(x3 - this.x) + Math.abs(y5 - this.y) < 1 && Math.abs(k4 - this.k) < 1e-3;
  }
  /** The scale at which a box fills the view. */
  scaleFor(box, margin = MARGIN) {
    return Math.min((this.width - 2 * margin) / box.w, (this.height - 2 * margin) / box.h);
  }
  animateTo(x3, y5, k4, time2 = 380) {
    cancelAnimationFrame(this.#animation);
    if (this.reducedMotion.matches) {
      this.set(x3, y5, k4);
      return;
    }
    const from = { x: this.x, y: this.y, k: this.k };
    const begun = performance.now();
    const step = (now) => {
      const part = Math.max(0, Math.min(1, (now - begun) / time2));
      const ease = 1 - (1 - part) ** 3;
      this.set(from.x + (x3 - from.x) * ease, from.y + (y5 - from.y) * ease, from.k + (k4 - from.k) * ease);
      if (part < 1) this.#animation = requestAnimationFrame(step);
    };
    this.#animation = requestAnimationFrame(step);
  }
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    cancelAnimationFrame(this.#animation);
    const k4 = Math.max(LEAST_SCALE, Math.min(MOST_SCALE, this.k * factor));
    this.set(px - (px - this.x) * k4 / this.k, py - (py - this.y) * k4 / this.k, k4);
  }
  pan(dx, dy) {
    cancelAnimationFrame(this.#animation);
    this.set(this.x + dx, this.y + dy, this.k);
  }
  /** @param y of the diagram */
  centre(x3, y5) {
    this.set(this.width / 2 - x3 * this.k, this.height / 2 - y5 * this.k, this.k);
  }
  #wheel(e4) {
    e4.preventDefault();
    const box = this.svg.getBoundingClientRect();
    const pixels = e4.deltaMode ? e4.deltaY * 16 : e4.deltaY;
    this.zoom(Math.exp(-pixels * 16e-4), e4.clientX - box.left, e4.clientY - box.top);
  }
};
function drag(onMove, onEnd, isMine = () => true) {
  const end = (e4) => {
    if (!isMine(e4)) return;
    removeEventListener("pointermove", onMove);
    removeEventListener("pointerup", end);
    removeEventListener("pointercancel", end);
    onEnd?.(e4);
  };
  addEventListener("pointermove", onMove);
  addEventListener("pointerup", end);
  addEventListener("pointercancel", end);
}
var STILL = 4;
function grab(element, {
  onPress,
  onPan,
  onZoom,
  onTap
}) {
  const pointers = /* @__PURE__ */ new Map();
  let moved2 = false;
  const grip = () => {
    const [a5, b3] = pointers.values();
    if (!b3) return { ...a5, wide: 0 };
    return { x: (a5.x + b3.x) / 2, y: (a5.y + b3.y) / 2, wide: Math.hypot(a5.x - b3.x, a5.y - b3.y) };
  };
  const down = (e4) => {
    if (e4.button !== 0) return;
    pointers.set(e4.pointerId, { x: e4.clientX, y: e4.clientY });
    if (pointers.size === 1) {
      moved2 = false;
      onPress?.();
    }
    const isMine = (m5) => m5.pointerId === e4.pointerId;
    drag(
      (m5) => {
        if (!isMine(m5)) return;
        if (!moved2 && Math.hypot(m5.clientX - e4.clientX, m5.clientY - e4.clientY) < STILL) return;
        moved2 = true;
        element.classList.add("grabbed");
        const before = grip();
        pointers.set(e4.pointerId, { x: m5.clientX, y: m5.clientY });
        const after = grip();
        onPan(after.x - before.x, after.y - before.y);
        const box = element.getBoundingClientRect();
        if (before.wide && after.wide) onZoom(after.wide / before.wide, after.x - box.left, after.y - box.top);
      },
      (m5) => {
        pointers.delete(e4.pointerId);
        if (pointers.size) return;
        element.classList.remove("grabbed");
        if (!moved2 && m5.type === "pointerup") onTap?.(e4);
      },
      isMine
    );
  };
  element.addEventListener("pointerdown", (e4) => down(e4));
}

// src/drawing/map.ts
var MARGIN2 = 10;
var MARKED = 20;
var ROBOT_M = 8;
var REACH = 9;
var SCAN_MS = 1500;
var RADIUS_M = 0.25;
var SMALLEST = 6;
var [CLOSEST, FARTHEST] = [400, 0.5];
var SCALES_M = [0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1e3];
var MapView = class {
  canvas;
  context;
  /** the robot that is kept in the middle; null: the whole map */
  followed = null;
  /** px per metre, and the place in the middle [m]; null: all */
  view = null;
  /** shown in place of the page's run, without links to it */
  given = null;
  #colours = new Colours();
  #floor = new Floor(this.#colours, () => this.draw());
  #labels;
  #scale = { k: 1, left: 0, bottom: 0 };
  constructor(canvas2) {
    this.canvas = canvas2;
    this.context = canvas2.getContext("2d");
    this.#labels = new Labels(this.context, this.#colours);
    canvas2.addEventListener("pointermove", (e4) => this.#hover(e4));
    canvas2.addEventListener("pointerleave", () => store.pointer.hover(null));
    grab(canvas2, {
      onPan: (dx, dy) => this.#pan(dx, dy),
      onZoom: (factor, px, py) => this.#zoom(factor, px, py),
      onTap: (e4) => this.#goTo(e4)
    });
    canvas2.addEventListener("wheel", (e4) => this.#wheel(e4), { passive: false });
    canvas2.addEventListener("dblclick", () => this.show(null));
    canvas2.addEventListener("keydown", (e4) => this.#key(e4));
    new ResizeObserver(() => this.draw()).observe(canvas2);
  }
  /** Read the colours again. */
  restyle() {
    this.#colours.forget();
    this.#floor.forget();
  }
  /** Reset the view for another machine. */
  reset() {
    this.view = null;
    this.followed = null;
    this.#floor.forget();
  }
  /** Show the whole map, or one robot. */
  show(robot) {
    this.followed = robot;
    this.view = null;
    this.draw();
  }
  /** The pixel of a place. @param place [m] @returns [px] */
  at(place) {
    return pixelOf(this.#scale, place);
  }
  #frame(scene, now, width, height) {
    const box = scene.extent(now);
    const robot = this.followed === null ? null : scene.robots.get(this.followed);
    const pose = robot && scene.poseAt(robot, now);
    const [margin, most] = scene.mapAt(now) ? [MARGIN2, Infinity] : [MARKED, Math.min(width, height) / ROBOT_M];
    const whole2 = box ? {
      k: Math.min(most, (width - 2 * margin) / box.w, (height - 2 * margin) / box.h),
      x: box.x + box.w / 2,
      y: box.y + box.h / 2
    } : { k: 20, x: 0, y: 0 };
    const view2 = this.view ?? whole2;
    const k4 = !this.view && pose ? Math.min(width, height) / ROBOT_M : view2.k;
    const middle = pose ?? view2;
    this.#scale = { k: k4, left: width / 2 - middle.x * k4, bottom: height / 2 + middle.y * k4 };
  }
  draw() {
    const { canvas: canvas2, context: g5 } = this;
    const size = fitted(g5);
    if (!size) return;
    const { width, height, ratio } = size;
    const { scene, now } = this.given ?? { scene: store.data.scene, now: store.playback.nowMs() };
    this.#frame(scene, now, width, height);
    const map = scene.mapAt(now);
    g5.fillStyle = this.#colours.of(map ? "unknown" : "floor");
    g5.fillRect(0, 0, width, height);
    if (map) this.#floor.draw(g5, map, this.#scale, ratio);
    else this.#floor.drawGrid(g5, this.#scale, width, height);
    const until = (this.given ? null : store.playback.cursor.value) ?? Infinity;
    for (const robot of scene.robots.values()) this.#seen(scene, robot, now, until);
    for (const robot of scene.robots.values()) this.#tracks(scene, robot, until);
    this.#labels.forget();
    this.#labels.keepFree(this.#scaleBox(width, height));
    this.#goals(scene, until);
    for (const [name, robot] of scene.robots) this.#robot(scene, name, robot, now);
    this.#scaleBar(width, height);
    canvas2.setAttribute("aria-label", sceneText(scene, now));
  }
  /** The scan and the plan of a robot. */
  #seen(scene, robot, now, until) {
    const g5 = this.context;
    const scan = robot.scans[countUntil(robot.scans, now) - 1];
    const pose = scene.poseAt(robot, now);
    if (scan && pose && now - scan.t < SCAN_MS) {
      const points2 = scanPoints(scan).map((point) => this.at(point));
      g5.fillStyle = this.#colours.of("active");
      g5.globalAlpha = 0.1;
      g5.beginPath();
      g5.moveTo(...this.at({ x: scan.at[0], y: scan.at[1] }));
      for (const point of points2) g5.lineTo(...point);
      g5.fill();
      g5.globalAlpha = 0.75;
      for (const [x3, y5] of points2) g5.fillRect(x3 - 1, y5 - 1, 2, 2);
      g5.globalAlpha = 1;
    }
    const plan = robot.plans[countUntil(robot.plans, Math.min(now, until)) - 1];
    if (!plan?.points.length) return;
    g5.strokeStyle = this.#colours.of("active");
    g5.lineWidth = 1.5;
    g5.setLineDash([2, 4]);
    this.#line(plan.points.map(([x3, y5]) => ({ x: x3, y: y5 })));
    g5.setLineDash([]);
  }
  #line(points2) {
    const g5 = this.context;
    g5.lineCap = g5.lineJoin = "round";
    g5.beginPath();
    for (const point of points2) g5.lineTo(...this.at(point));
    g5.stroke();
  }
  #tracks(scene, robot, until) {
    const g5 = this.context;
    const lit = store.pointer.hovered.value;
    const pieces = scene.piecesOf(robot);
    const isLit = (one) => lit !== null && one.path === lit.path && one.visit === lit.from;
    const anyLit = pieces.some(isLit);
    for (const piece of pieces) {
      const count = piece.poses[piece.poses.length - 1].t <= until ? piece.poses.length : countUntil(piece.poses, until);
      if (count < 1) break;
      const poses = count === piece.poses.length ? piece.poses : piece.poses.slice(0, count);
      if (isLit(piece)) {
        g5.strokeStyle = this.#colours.of("ink");
        g5.lineWidth = 12;
        this.#line(poses);
        g5.strokeStyle = this.#colours.of("halo");
        g5.lineWidth = 10;
        this.#line(poses);
      }
      const number = piece.path === null ? -1 : scene.colourOf(piece.path);
      g5.strokeStyle = this.#colours.of(number < 0 ? "muted" : `s${1 + number % COLOURS}`);
      g5.lineWidth = number < 0 ? 1 : 2.5;
      if (number >= COLOURS) g5.setLineDash([6, 4]);
      g5.globalAlpha = anyLit && !isLit(piece) ? 0.4 : 0.9;
      this.#line(poses);
      g5.globalAlpha = 1;
      g5.setLineDash([]);
    }
  }
  /** Draw each goal's place once, with the status of the newest goal there. */
  #goals(scene, until) {
    const g5 = this.context;
    const places = /* @__PURE__ */ new Map();
    for (const robot of scene.robots.values())
      for (const goal of robot.goals)
        if (goal.t <= until) places.set(`${goal.x.toFixed(1)} ${goal.y.toFixed(1)}`, goal);
    g5.textBaseline = "middle";
    for (const goal of places.values()) {
      const [x3, y5] = this.at(goal);
      this.#labels.keepFree({ left: x3 - 8, top: y5 - 8, right: x3 + 8, bottom: y5 + 8 });
    }
    for (const goal of places.values()) {
      const [x3, y5] = this.at(goal);
      const runs2 = goal.to === null || goal.to > until;
      const kind = runs2 ? "active" : outcomeClass(goal.status);
      g5.fillStyle = this.#colours.of(runs2 ? "floor" : `${kind}-fill`);
      g5.strokeStyle = this.#colours.of(kind);
      g5.lineWidth = 1.75;
      if (kind === "preempted") g5.setLineDash([3, 2]);
      g5.beginPath();
      g5.arc(x3, y5, 7, 0, 7);
      g5.fill();
      g5.stroke();
      g5.setLineDash([]);
      g5.beginPath();
      if (runs2) {
        g5.fillStyle = this.#colours.of(kind);
        g5.arc(x3, y5, 3, 0, 7);
        g5.fill();
      } else if (kind === "success") {
        g5.moveTo(x3 - 3, y5);
        g5.lineTo(x3 - 1, y5 + 2.5);
        g5.lineTo(x3 + 3.5, y5 - 2.5);
        g5.stroke();
      } else {
        g5.moveTo(x3 - 2.5, y5 - 2.5);
        g5.lineTo(x3 + 2.5, y5 + 2.5);
        if (kind === "failure") {
          g5.moveTo(x3 + 2.5, y5 - 2.5);
          g5.lineTo(x3 - 2.5, y5 + 2.5);
        }
        g5.stroke();
      }
      this.#labels.write(scene.placeName(goal), x3, y5, runs2);
    }
  }
  #robot(scene, name, robot, now) {
    const pose = scene.poseAt(robot, now);
    if (!pose) return;
    const g5 = this.context;
    const [x3, y5] = this.at(pose);
    const r4 = Math.max(SMALLEST, RADIUS_M * this.#scale.k);
    g5.save();
    g5.translate(x3, y5);
    g5.rotate(-pose.yaw);
    g5.fillStyle = this.#colours.of("active");
    g5.strokeStyle = this.#colours.of("floor");
    g5.lineWidth = 1.5;
    g5.beginPath();
    g5.arc(0, 0, r4, 0, 7);
    g5.fill();
    g5.stroke();
    g5.fillStyle = this.#colours.of("floor");
    g5.beginPath();
    g5.moveTo(0.7 * r4, 0);
    g5.lineTo(-0.35 * r4, 0.5 * r4);
    g5.lineTo(-0.35 * r4, -0.5 * r4);
    g5.fill();
    g5.restore();
    if (scene.robots.size > 1) this.#labels.write(name, x3, y5 - r4 - 7, true);
  }
  /** The box of the scale, at the bottom right. */
  #scaleBox(width, height) {
    const metres = SCALES_M.find((m5) => m5 * this.#scale.k >= 44) ?? 1e3;
    const long = metres * this.#scale.k;
    const [left, top] = [width - long - 20, height - 27];
    return { metres, long, left, top, right: left + long + 12, bottom: top + 22 };
  }
  #scaleBar(width, height) {
    const g5 = this.context;
    const { metres, long, left, top } = this.#scaleBox(width, height);
    const [x3, y5] = [left + 6, top + 17];
    g5.globalAlpha = 0.85;
    g5.fillStyle = this.#colours.of("floor");
    g5.fillRect(left, top, long + 12, 22);
    g5.globalAlpha = 1;
    g5.strokeStyle = g5.fillStyle = this.#colours.of("ink");
    g5.lineWidth = 1.25;
    g5.beginPath();
    g5.moveTo(x3, y5 - 3);
    g5.lineTo(x3, y5);
    g5.lineTo(x3 + long, y5);
    g5.lineTo(x3 + long, y5 - 3);
    g5.stroke();
    g5.font = FONT;
    g5.textAlign = "center";
    g5.textBaseline = "middle";
    g5.fillText(`${metres} m`, x3 + long / 2, y5 - 9);
  }
  // -- input --------------------------------------------------------------------------------------
  #nearest(e4) {
    if (this.given) return null;
    const { x: x3, y: y5 } = placeAt(this.#scale, e4.offsetX, e4.offsetY);
    return store.data.scene.nearest(x3, y5, REACH / this.#scale.k, store.playback.cursor.value ?? Infinity);
  }
  #hover(e4) {
    const found = this.#nearest(e4);
    this.canvas.style.cursor = found ? "pointer" : "";
    const { path, visit } = found?.piece ?? { path: null, visit: null };
    store.pointer.hover(path === null || visit === null ? null : { path, from: visit });
  }
  /** Go to the instant at which a robot was at the pointer. */
  #goTo(e4) {
    const found = this.#nearest(e4);
    if (!found) return;
    store.playback.seek(found.t);
    if (found.piece.path) store.view.selected.value = found.piece.path;
  }
  #pan(dx, dy) {
    this.followed = null;
    const middle = placeAt(this.#scale, this.canvas.clientWidth / 2 - dx, this.canvas.clientHeight / 2 - dy);
    this.view = { k: this.#scale.k, ...middle };
    this.draw();
  }
  #wheel(e4) {
    e4.preventDefault();
    this.#zoom(Math.exp(-e4.deltaY * 16e-4), e4.offsetX, e4.offsetY);
  }
  /** @param py the place that stays */
  #zoom(factor, px = this.canvas.clientWidth / 2, py = this.canvas.clientHeight / 2) {
    const held = placeAt(this.#scale, px, py);
    const k4 = Math.max(FARTHEST, Math.min(this.#scale.k * factor, CLOSEST));
    const [w5, h5] = [this.canvas.clientWidth, this.canvas.clientHeight];
    this.view = { k: k4, x: held.x + (w5 / 2 - px) / k4, y: held.y - (h5 / 2 - py) / k4 };
    this.draw();
  }
  #key(e4) {
    const zoom = { "+": 1.25, "=": 1.25, "-": 0.8 }[e4.key];
    if (zoom) this.#zoom(zoom);
    else if (e4.key === "0") this.show(null);
    else return;
    e4.preventDefault();
    e4.stopPropagation();
  }
};

// src/drawing/minimap.ts
var SHOWN_BELOW = 0.6;
var CORNERS = ["bottom-right", "bottom-left", "top-right", "top-left"];
var Minimap = class {
  svg;
  #size = null;
  // of the machine
  #rects = /* @__PURE__ */ new Map();
  // by path
  #leaves = [];
  // of the states that are not opened
  #due = /* @__PURE__ */ new Map();
  // changes to paint: path -> whether the state is active
  #window = el("rect", { class: "window" });
  // the part in view
  /** @param onCentre called with the place in the diagram that was pressed */
  constructor(svg2, onCentre) {
    this.svg = svg2;
    const move = (e4) => {
      const matrix = svg2.getScreenCTM();
      if (!matrix) return;
      const { x: x3, y: y5 } = new DOMPoint(e4.clientX, e4.clientY).matrixTransform(matrix.inverse());
      onCentre(x3, y5);
    };
    svg2.addEventListener("pointerdown", (pressed) => {
      drag(move);
      move(pressed);
    });
  }
  draw({ size, boxes, states: states2 }) {
    if (!size) return;
    this.#size = size;
    this.#rects.clear();
    this.#due.clear();
    this.#leaves = [];
    this.svg.setAttribute("viewBox", `0 0 ${size.w} ${size.h}`);
    for (const [path, box] of boxes) {
      const isOpen2 = states2.get(path)?.group.classList.contains("box");
      const place = { x: box.x, y: box.y, width: box.w, height: box.h, rx: 6 };
      this.#rects.set(path, el("rect", { class: isOpen2 ? "area" : "spot", ...place }));
      if (!isOpen2) this.#leaves.push(box);
    }
    this.svg.replaceChildren(...this.#rects.values(), this.#window);
  }
  /** Light a state, or not, at the next painting. */
  light(path, active) {
    this.#due.set(path, active);
  }
  /** Paint what has changed; a few times a second, as doing it at every event costs as much as the rest. */
  paint() {
    for (const [path, active] of this.#due) this.#rects.get(path)?.classList.toggle("active", active);
    this.#due.clear();
  }
  /** Show which part is in view; if it is most of the machine, there is no minimap. */
  showWindow(view2) {
    if (!this.#size) return;
    const { x: x3, y: y5, k: k4, width, height } = view2;
    const { w: w5, h: h5 } = this.#size;
    const own2 = { w: this.svg.clientWidth, h: this.svg.clientHeight };
    const place = { x: -x3 / k4, y: -y5 / k4, width: width / k4, height: height / k4 };
    for (const [name, value] of Object.entries(place)) this.#window.setAttribute(name, String(value));
    this.#window.style.strokeWidth = `${Math.max(w5, h5) / 70}px`;
    const seen2 = (from, size, room) => Math.max(0, Math.min(room, from + size * k4) - Math.max(0, from)) / (size * k4);
    const isIdle = seen2(x3, w5, width) * seen2(y5, h5, height) > SHOWN_BELOW;
    this.svg.classList.toggle("idle", isIdle);
    if (!isIdle) this.svg.setAttribute("data-corner", this.#freeCorner(view2, own2));
  }
  /** The corner of the view where the minimap covers the fewest states. @param own its size [px] */
  #freeCorner({ x: x3, y: y5, k: k4, width, height }, own2) {
    const [w5, h5] = [own2.w + 20, own2.h + 20];
    const covered = Object.fromEntries(CORNERS.map((corner) => [corner, 0]));
    for (const box of this.#leaves) {
      const [left, top] = [box.x * k4 + x3, box.y * k4 + y5];
      const [right, bottom] = [left + box.w * k4, top + box.h * k4];
      for (const corner of CORNERS) {
        const atX = corner.endsWith("right") ? right > width - w5 && left < width : left < w5 && right > 0;
        const atY = corner.startsWith("bottom") ? bottom > height - h5 && top < height : top < h5 && bottom > 0;
        if (atX && atY) covered[corner] += 1;
      }
    }
    const now = this.svg.getAttribute("data-corner") ?? CORNERS[0];
    return CORNERS.reduce((best, one) => covered[one] < covered[best] ? one : best, now);
  }
};

// src/core/statistics.ts
var MODES = [
  ["none", "No numbers"],
  ["counts", "Counts of this run"],
  ["time", "Time in this run"],
  ["runs", "Recorded runs"],
  ["failures", "Failures in recorded runs"],
  ["compare", "This run against recorded runs"]
];
var OF_RECORDED_RUNS = ["runs", "failures", "compare"];
var total = (outcomes) => Object.values(outcomes ?? {}).reduce((a5, b3) => a5 + b3, 0);
function numbersFor(mode, run, statistics, model) {
  const recorded = statistics?.states ?? {};
  const counts = (states2) => (path, outcome) => {
    const outcomes = own(states2, path)?.outcomes;
    const count = own(outcomes, outcome);
    return count ? { count, share: count / total(outcomes) } : null;
  };
  switch (mode) {
    case "counts":
      return { countOf: counts(run), heatOf: null };
    case "time": {
      const most = mostSeconds(run, model);
      return { countOf: counts(run), heatOf: (path) => Math.min(1, (own(run, path)?.seconds ?? 0) / most) };
    }
    case "runs":
      return { countOf: counts(recorded), heatOf: null };
    case "failures":
      return { countOf: counts(recorded), heatOf: (path) => own(recorded, path)?.failures ?? 0 };
    case "compare":
      return { countOf: counts(run), heatOf: (path) => slower(own(run, path), own(recorded, path)) };
    default:
      return { countOf: null, heatOf: null };
  }
}
function mostSeconds(run, model) {
  const leaves = Object.entries(run).filter(([path]) => !model?.get(path)?.children.length);
  return Math.max(1e-3, ...leaves.map(([, state]) => state.seconds));
}
function heatScale(mode, run, model) {
  switch (mode) {
    case "time":
      return ["0 s", duration(mostSeconds(run, model))];
    case "failures":
      return ["none failed", "all failed"];
    case "compare":
      return ["as usual", "twice as long"];
    default:
      return null;
  }
}
function slower(state, recorded) {
  if (!state || !recorded?.median) return 0;
  const ended = total(state.outcomes);
  return ended ? Math.min(1, Math.max(0, state.seconds / ended / recorded.median - 1)) : 0;
}
function coverage(model, run) {
  let taken = 0;
  let all = 0;
  for (const node of model?.order ?? [])
    for (const edge of node.edges) {
      if (edge.implicit) continue;
      for (const outcome of edge.outcomes) {
        all += 1;
        if (own(own(run, `${node.path}/${edge.source}`)?.outcomes, outcome)) taken += 1;
      }
    }
  return { taken, all };
}

// src/drawing/painter.ts
var Painter = class {
  diagram;
  constructor(diagram) {
    this.diagram = diagram;
  }
  /** Paint the states with these paths, and what their containers show of them, as they are now. */
  paintChanged(paths) {
    const { diagram } = this;
    const data = store.data.run.now;
    const now = store.playback.nowMs();
    for (const path of paths) {
      diagram.paintJoins(path, data.states);
      diagram.paintJoins(containerOf(path), data.states);
      diagram.paintNet(path, data.states[path]);
      if (!diagram.picture.states.has(path)) continue;
      const goal = Object.values(data.goals).findLast((one) => one.path === path && one.ended == null);
      diagram.paint(path, data.states[path], now, goal, store.status.hasNoServer(goal));
    }
  }
  /** Paint everything, as it was at the instant shown. */
  paintAll() {
    const { diagram } = this;
    if (!diagram.size) return;
    const data = store.playback.shown();
    const now = store.playback.nowMs();
    const running = Object.values(data.goals).filter((goal) => goal.ended == null);
    const goals = new Map(running.map((goal) => [goal.path, goal]));
    for (const path of diagram.picture.boxes.keys()) {
      const goal = goals.get(path);
      diagram.paint(path, data.states[path], now, goal, store.status.hasNoServer(goal));
    }
    for (const path of diagram.picture.joins.keys()) diagram.paintJoins(path, data.states);
    diagram.paintCards(insideText);
    for (const path of diagram.picture.boxes.keys()) diagram.paintNet(path, data.states[path]);
    const stops = store.data.facts.value?.control?.breakpoints ?? [];
    const pathsOf = (some) => some.map(([path]) => path);
    diagram.mark(pathsOf(stops.filter(([, outcome]) => outcome === null)), "stopped");
    diagram.mark(pathsOf(stops.filter(([, outcome]) => outcome !== null)), "stopped-after");
    diagram.mark(store.view.selected.value ? [store.view.selected.value] : [], "selected");
    const differing = reproduction()?.found?.difference?.path;
    diagram.mark(differing ? [differing] : [], "differs");
    diagram.showWay(store.data.wayShown.value);
    this.showNumbers();
  }
  /** Flash the transitions that were just taken. @param moment [ms] */
  flash(events, moment) {
    for (const e4 of events)
      if (e4.kind === "Fired") this.diagram.flashFired(e4.path, e4.transition, moment);
      else this.diagram.flash(e4.path, e4.kind === "Left" ? e4.outcome : RAISED, moment);
  }
  /** Paint what changes without events: the clocks of running states, closed containers, numbers. */
  paintBeat() {
    if (store.playback.cursor.value === null) {
      const { states: states2 } = store.data.run.now;
      const now = store.playback.nowMs();
      for (const path of store.status.activePaths.value)
        if (states2[path]) this.diagram.updateBadge(path, states2[path], now);
      this.diagram.paintCards(insideText);
    }
    if (store.view.numbers.value !== "none") this.showNumbers();
  }
  showNumbers() {
    const { statistics, model } = store.data;
    const { states: states2 } = store.playback.shown();
    const { countOf: countOf2, heatOf } = numbersFor(store.view.numbers.value, states2, statistics.value, model.value);
    this.diagram.showNumbers(countOf2, heatOf);
  }
};

// src/drawing/scheduler.ts
var PANELS_MS = 160;
var SLOWEST_PANELS_MS = 800;
var IN_TIME_MS = 25;
var PANELS_PER_LATE = 8;
var LATE_PART = 0.1;
var TEXT_MS = 400;
var BEAT_MS = 200;
var BUSY = 15;
var ANNOUNCE_MS = 1e3;
var PLAY_MS = 45;
var BURST = 500;
var FLASHING = ["Left", "Failed", "Fired"];
var Scheduler = class {
  frame = 0;
  // the requested animation frame
  changed = /* @__PURE__ */ new Set();
  // paths to paint in it
  flashes = [];
  // transitions to flash in it
  latency = new Latency();
  #drawn;
  #askedAt = 0;
  // time of the request [ms]
  #late = 0;
  // average lateness of frames [ms]
  #playFrame = 0;
  // the requested animation frame while playing
  #playedAt = 0;
  // [ms]
  #panelsAt = 0;
  // time of their last update [ms]
  #panelsDue = 0;
  #textAt = 0;
  #drawDue = 0;
  #announcedAt = 0;
  #newestSeq = 0;
  constructor(drawn) {
    this.#drawn = drawn;
    store.playback.playing.subscribe((playing) => {
      if (playing && !this.#playFrame) this.#playFrame = requestAnimationFrame((moment) => this.#play(moment));
    });
  }
  start() {
    setInterval(() => {
      this.#drawn.painter.paintBeat();
      this.#panels(performance.now());
    }, BEAT_MS);
  }
  takeEvents(events) {
    const live = store.playback.cursor.value === null && !document.hidden;
    for (const e4 of events) {
      this.changed.add(e4.path);
      if (live && FLASHING.includes(e4.kind)) this.flashes.push(e4);
      if (live && events.length < BURST) this.latency.arrived.push(e4.stamp_ns / 1e6);
    }
    store.addEvents(events);
    if (!events.length) this.#drawn.painter.paintAll();
    this.#schedule();
  }
  takeObserved(records) {
    store.data.addObserved(records);
    this.#schedule();
  }
  #schedule() {
    if (this.frame) return;
    this.#askedAt = performance.now();
    this.frame = requestAnimationFrame(() => this.#draw());
  }
  #draw() {
    this.frame = 0;
    const moment = performance.now();
    this.#late += LATE_PART * (moment - this.#askedAt - this.#late);
    const flashes = this.flashes.splice(0);
    const arrived = this.latency.arrived.splice(0);
    if (store.playback.cursor.value === null) {
      this.#drawn.painter.paintChanged(this.changed);
      this.changed.clear();
      this.#drawn.painter.flash(flashes, moment);
      this.latency.painting(arrived);
    }
    if (this.#drawn.painter.diagram.endFlashes(moment)) this.#schedule();
    const pause = this.#panelsPause;
    if (moment - this.#panelsAt > pause) this.#panels(moment);
    else this.#panelsDue ||= setTimeout(() => this.#panels(performance.now()), pause);
  }
  /** Time between two updates of the panels [ms]; longer on a slow browser, as the diagram has priority. */
  get #panelsPause() {
    return Math.min(SLOWEST_PANELS_MS, PANELS_MS + PANELS_PER_LATE * Math.max(0, this.#late - IN_TIME_MS));
  }
  #panels(moment) {
    clearTimeout(this.#panelsDue);
    this.#panelsDue = 0;
    this.#panelsAt = moment;
    store.playback.update();
    store.panels.hasMap.value = !store.data.scene.isEmpty;
    if (moment - this.#textAt > TEXT_MS) {
      this.#textAt = moment;
      store.playback.updateSlow();
      const newest3 = store.data.run.events.at(-1)?.seq ?? 0;
      const isBusy = newest3 - this.#newestSeq > 3 * BUSY * (TEXT_MS / 1e3);
      this.#newestSeq = newest3;
      this.#drawn.painter.diagram.svg.classList.toggle("busy", isBusy);
      this.#drawn.timeline.tellInstant();
    }
    this.#drawDue ||= setTimeout(() => {
      this.#drawDue = 0;
      this.#drawn.timeline.draw();
      this.#drawn.map.draw();
      this.#drawn.minimap.paint();
    }, PANELS_MS / 2);
    this.#announce(moment);
    this.#drawn.onPanels();
  }
  /** Announce the running states to screen readers. */
  #announce(moment) {
    const region = document.getElementById("announced");
    if (!region || moment - this.#announcedAt < ANNOUNCE_MS) return;
    const leaves = store.status.activeLeaves.value.slice(0, 6);
    const names = leaves.map((path) => store.data.nameOf(path)).join(", ");
    const text2 = [store.status.runStatus.value.word, names].filter(Boolean).join(": ");
    if (region.textContent === text2) return;
    region.textContent = text2;
    this.#announcedAt = moment;
  }
  #play(moment) {
    this.#playFrame = 0;
    if (!store.playback.playing.value) return;
    this.#playFrame = requestAnimationFrame((next) => this.#play(next));
    if (moment - this.#playedAt < PLAY_MS) return;
    this.#playedAt = moment;
    store.playback.playOn(performance.now());
  }
};
var Latency = class {
  arrived = [];
  // stamps of events to paint
  measured = [];
  // [ms]
  #painting = [];
  // stamps of events in the frame that is being painted
  #port = new MessageChannel();
  // its message comes after the paint
  constructor() {
    this.#port.port1.onmessage = () => {
      const now = performance.timeOrigin + performance.now();
      for (const stamp of this.#painting.splice(0)) this.measured.push(now - stamp);
      if (this.measured.length > 2e4) this.measured.splice(0, 1e4);
    };
  }
  /** @param stamps of the events that are painted in this frame */
  painting(stamps) {
    if (!stamps.length) return;
    this.#painting.push(...stamps);
    this.#port.port2.postMessage(0);
  }
};

// src/core/density.ts
function densityOf(events, columnOf, columns, model = null) {
  const found = { counts: new Array(columns).fill(0), failures: [], preempts: [], starts: [] };
  let begun = false;
  for (const e4 of events) {
    const t4 = e4.stamp_ns / 1e6;
    found.counts[Math.max(0, Math.min(columns - 1, Math.floor(columnOf(t4))))] += 1;
    const isFailure2 = e4.kind === "Failed" || e4.kind === "Left" && endClass(model?.get(e4.path), e4.outcome) === "failure";
    if (isFailure2) found.failures.push(t4);
    else if (e4.kind === "PreemptRequested") found.preempts.push(t4);
    else if (e4.kind === "Started") {
      if (begun) found.starts.push(t4);
      begun = true;
    }
  }
  return found;
}
var asksIn = (waits, now) => waits.filter(({ kind }) => kind === "asks").map(({ from, to }) => [from, to ?? now]);

// src/drawing/time_window.ts
var LIVE_MS = 3e4;
var SHORTEST_MS2 = 20;
var LONGEST_MS = 30 * 864e5;
var WIDE2 = 1e3;
var TimeWindow = class {
  length = LIVE_MS;
  // [ms]
  end = null;
  // [ms]; null: now
  reset() {
    this.end = null;
    this.length = LIVE_MS;
  }
  /** Show the whole run. */
  fitAll() {
    const first = store.data.run.first();
    const last = store.playback.nowMs();
    if (first == null) return;
    const folded = store.clock.folds().reduce((sum, one) => sum + lengthOf(one), 0);
    const margin = (last - first - folded) * 0.02;
    this.length = Math.max(SHORTEST_MS2, last - first + 2 * margin);
    this.end = Math.max(last + margin, first + this.length * 0.98);
  }
  /** Show a visit with some time around it. @param to [ms] */
  fit(from, to) {
    this.length = Math.max(SHORTEST_MS2, (to - from) * 1.1);
    this.end = (from + to) / 2 + this.length / 2;
  }
  /** Show a range [ms]; one that reaches the present of a running machine moves on with it. */
  show({ from, to }) {
    const { playback, data } = store;
    const isLive = playback.cursor.value === null && playback.goes.value && to >= data.liveMs();
    this.length = Math.max(SHORTEST_MS2, to - from);
    this.end = isLive ? null : to;
  }
  /** The range [ms]. */
  range() {
    const now = store.playback.nowMs();
    const isPast = store.playback.cursor.value !== null;
    let end = this.end ?? now + this.length * 0.01;
    if (this.end === null && isPast) end = now + this.length / 2;
    const first = store.data.run.first();
    if (this.end === null && !isPast && first != null) end = Math.max(end, first + this.length * 0.98);
    return [end - this.length, end];
  }
  /** Where the instants of the range are between two places. */
  axis(left, right) {
    const [from, to] = this.range();
    return new Axis(store.clock.folds(), { from, to }, left, right);
  }
  /** Let the range stay where it is. */
  hold() {
    this.end ??= this.range()[1];
  }
  /** Move the range by a part of what it shows. */
  move(part) {
    const axis = this.axis(0, WIDE2);
    const [from, to] = [part * WIDE2, (1 + part) * WIDE2].map((px) => axis.timeAt(px));
    this.length = Math.max(SHORTEST_MS2, to - from);
    this.end = to;
  }
  /** Make the range longer by a factor, around an instant [ms]. */
  zoom(factor, at) {
    const axis = this.axis(0, WIDE2);
    const isHeld = this.end !== null || store.playback.cursor.value !== null;
    const fixed = isHeld ? axis.x(at) : WIDE2;
    const [from, to] = [0, WIDE2].map((px) => axis.timeAt(fixed + (px - fixed) * factor));
    const length = Math.max(SHORTEST_MS2, Math.min(to - from, LONGEST_MS));
    if (isHeld) this.end = length === to - from ? to : at + (to - at) * length / (to - from);
    this.length = length;
  }
  /** Keep the played instant in view. */
  keepInView() {
    const at = store.playback.cursor.value;
    if (this.end === null || at === null || !store.playback.playing.value) return;
    if (at > this.end - 0.02 * this.length) this.end = at + 0.8 * this.length;
    else if (at < this.end - this.length) this.end = at + 0.95 * this.length;
  }
};

// src/drawing/strip.ts
var RIGHT = 14;
var GRIP = 8;
var COLUMN = 3;
var FAILURE2 = 2.5;
var Strip = class {
  canvas;
  left = 168;
  // where the lanes begin [px]
  shown = { from: 0, to: 1 };
  // what the timeline shows [ms]
  #context;
  #colours = new Colours();
  #onRange;
  #density = null;
  #key = "";
  /** @param onRange called with the range that the timeline is to show [ms]; null: the whole */
  constructor(canvas2, onRange) {
    this.canvas = canvas2;
    this.#context = canvas2.getContext("2d");
    this.#onRange = onRange;
    canvas2.addEventListener("pointerdown", (e4) => this.#down(e4));
    canvas2.addEventListener("dblclick", () => this.#onRange(null));
  }
  restyle() {
    this.#colours.forget();
  }
  /** The time of the whole run [ms]; null before it begins. */
  #whole() {
    const from = store.data.run.first();
    if (from === null) return null;
    return { from, to: Math.max(store.data.liveMs(), from + SHORTEST_MS2) };
  }
  draw() {
    const g5 = this.#context;
    const size = fitted(g5);
    const whole2 = this.#whole();
    if (!size || !whole2) return;
    const { width, height } = size;
    const wide = width - this.left - RIGHT;
    if (wide < 40) return;
    const axis = new Axis(store.clock.folds(), whole2, this.left, this.left + wide);
    const x3 = (t4) => axis.x(t4);
    const columns = Math.floor(wide / COLUMN);
    const { events } = store.data.run;
    const step = (whole2.to - whole2.from) / columns;
    const end = Math.floor(whole2.to / Math.max(step, 250));
    const folds = axis.folds.map(({ from }) => from);
    const key = [store.data.model.value?.root.path, events[0]?.seq, events.length, columns, end, ...folds].join(" ");
    if (key !== this.#key || !this.#density) {
      this.#density = densityOf(events, (t4) => (x3(t4) - this.left) / COLUMN, columns, store.data.model.value);
      this.#key = key;
    }
    const { counts, failures, preempts, starts } = this.#density;
    g5.clearRect(0, 0, width, height);
    const most = Math.max(1, ...counts);
    g5.fillStyle = this.#colours.of("faint");
    for (const [i4, count] of counts.entries()) {
      const tall = Math.sqrt(count / most) * (height - 6);
      if (count) g5.fillRect(this.left + i4 * COLUMN, height - 3 - tall, COLUMN - 0.5, tall);
    }
    g5.fillStyle = this.#colours.of("waiting-fill");
    for (const [from, to] of asksIn(store.data.run.waits, whole2.to))
      g5.fillRect(x3(from), 3, Math.max(2, x3(to) - x3(from)), height - 6);
    for (const [from, to] of store.data.run.now.outages ?? []) {
      g5.fillStyle = this.#colours.of("background");
      g5.fillRect(x3(from / 1e6), 0, Math.max(2, x3(to / 1e6) - x3(from / 1e6)), height);
    }
    const ticks2 = (colour, instants2, thick, top) => {
      g5.fillStyle = this.#colours.of(colour);
      for (const t4 of instants2) g5.fillRect(x3(t4) - thick / 2, top, thick, height - top);
    };
    g5.strokeStyle = this.#colours.of("muted");
    g5.lineWidth = 1.2;
    for (const { from, to } of axis.folds) {
      const [begin, last] = [x3(from), x3(to)];
      g5.fillStyle = this.#colours.of("depth2");
      g5.fillRect(begin, 0, last - begin, height);
      g5.beginPath();
      for (let y5 = 0, side = -1; y5 <= height; y5 += 4, side = -side) g5.lineTo((begin + last) / 2 + 2.5 * side, y5);
      g5.stroke();
    }
    ticks2("preempted", preempts, 1.5, height / 2);
    ticks2("ink", starts, 1.5, 0);
    ticks2("failure", failures, FAILURE2, 0);
    this.#window(x3, height, width);
    const at = store.playback.cursor.value;
    if (at !== null) ticks2("active", [at], 2, 0);
  }
  /** Draw what the timeline shows, with its ends. */
  #window(x3, height, width) {
    const g5 = this.#context;
    const [left, right] = this.#ends(x3, width);
    g5.fillStyle = this.#colours.of("active");
    g5.globalAlpha = 0.12;
    g5.fillRect(left, 0, right - left, height);
    g5.globalAlpha = 1;
    g5.strokeStyle = this.#colours.of("active");
    g5.lineWidth = 1.5;
    g5.strokeRect(left + 0.75, 0.75, right - left - 1.5, height - 1.5);
    for (const px of [left, right]) {
      g5.beginPath();
      g5.roundRect(px - GRIP / 2, height / 2 - 9, GRIP, 18, 3);
      g5.fillStyle = this.#colours.of("background");
      g5.fill();
      g5.stroke();
    }
  }
  #ends(x3, width) {
    const inside2 = (px) => Math.max(this.left, Math.min(width - RIGHT, px));
    const left = inside2(x3(this.shown.from));
    return [left, Math.max(inside2(x3(this.shown.to)), left + 4)];
  }
  /** Drag the window or one of its ends; a press beside it brings it there. */
  #down(e4) {
    const whole2 = this.#whole();
    const width = this.canvas.clientWidth;
    const { left: edge } = this.canvas.getBoundingClientRect();
    const wide = width - this.left - RIGHT;
    if (!whole2 || e4.button !== 0 || e4.clientX - edge < this.left - GRIP) return;
    const axis = new Axis(store.clock.folds(), whole2, this.left, this.left + wide);
    const [left, right] = this.#ends((t4) => axis.x(t4), width);
    const px = e4.clientX - edge;
    let { from, to } = this.shown;
    const near = (end) => Math.abs(px - end) <= GRIP;
    const isLeft = near(left) && !(near(right) && px > (left + right) / 2);
    const isRight = !isLeft && near(right);
    if (!isLeft && !isRight && (px < left || px > right)) {
      const half = (axis.x(to) - axis.x(from)) / 2;
      [from, to] = [axis.timeAt(px - half), axis.timeAt(px + half)];
      this.#onRange({ from, to });
    }
    drag((m5) => {
      const moved2 = (t4) => axis.timeAt(axis.x(t4) + m5.clientX - e4.clientX);
      if (isLeft) this.#onRange({ from: Math.min(moved2(from), to - SHORTEST_MS2), to });
      else if (isRight) this.#onRange({ from, to: Math.max(moved2(to), from + SHORTEST_MS2) });
      else this.#onRange({ from: moved2(from), to: moved2(to) });
    });
  }
};

// src/drawing/bars.ts
var THINNEST = 0.5;
var FAILED = 3;
var LATER = 0.35;
var NAME = 11;
var TRACK = 2;
var LEAST_LETTERS = 2;
var MOST_WIDTHS = 4e3;
var Bars = class {
  context;
  colours;
  hits = [];
  // the bars of visits that were drawn since they were forgotten
  #widths = /* @__PURE__ */ new Map();
  // of texts in bars [px]
  constructor(context2, colours) {
    this.context = context2;
    this.colours = colours;
  }
  forget() {
    this.hits = [];
  }
  /** Draw a lane's name, bars and waits. */
  lane(lane, y5, lanes, model, scale) {
    const g5 = this.context;
    const h5 = lanes.heightOf(lane);
    g5.fillStyle = this.colours.of("muted");
    g5.textAlign = "left";
    const indent = 10 + Math.min(lane.depth, 6) * 9;
    const room = scale.left - 8 - indent;
    const widthOf = (one) => this.#widthOf(one, NAME);
    const name = widthOf(lane.name) > room ? beginningOf(lane.name, room, widthOf) : lane.name;
    g5.fillText(name, indent, y5 + h5 / 2);
    this.#visits(lane, y5, lanes, model, scale);
    this.#waits(lane, y5, lanes, model, scale);
  }
  #visits(lane, y5, lanes, model, axis) {
    const { from, to, left, right } = axis;
    const x3 = (t4) => axis.x(t4);
    const g5 = this.context;
    const now = store.playback.nowMs();
    const isOneRow = lanes.rowsOf(lane) === 1;
    let lastPx = -10;
    const failures = [];
    for (const span of lanes.spansIn(lane, from, to)) {
      const later = span.from > now;
      const ended = span.to !== null && (later || span.to <= now);
      const until = span.to ?? Math.max(now, store.data.run.last() ?? now);
      const node = model.get(span.path);
      if (until < from || !node) continue;
      const begin = Math.max(left, x3(span.from));
      const end = Math.min(right + 2, x3(until));
      const isFailure2 = ended && endClass(node, span.outcome) === "failure";
      if (isOneRow && end - lastPx < THINNEST && ended && !isFailure2) continue;
      lastPx = Math.max(lastPx, end);
      const wide = Math.max(isFailure2 ? FAILED : 2, end - begin);
      const hit = { left: begin, right: begin + wide, ...rowOf(lanes, lane, node, span.from, y5), span };
      const paint2 = () => {
        g5.globalAlpha = later ? LATER : 1;
        this.#visit(hit, node, ended, x3, later ? Infinity : now);
        g5.globalAlpha = 1;
        this.hits.push(hit);
      };
      if (isFailure2) failures.push(paint2);
      else paint2();
    }
    for (const paint2 of failures) paint2();
  }
  /** @param now the instant shown [ms]; later parts are pale */
  #visit({ span, ...bar }, node, ended, x3, now) {
    const g5 = this.context;
    const { left, right, top, bottom } = bar;
    const [wide, tall] = [right - left, bottom - top];
    const asked2 = span.preempt !== null && span.preempt <= now ? span.preempt : null;
    const kind = ended ? endClass(node, span.outcome) : asked2 !== null ? "preempted" : "active";
    const shown = x3(now);
    const paint2 = () => this.#body({ span, ...bar }, kind, asked2 === null ? null : x3(asked2));
    if (!ended && shown < right - 1) {
      g5.globalAlpha = LATER;
      clipped(g5, shown, top - 1, right + 1 - shown, tall + 2, paint2);
      g5.globalAlpha = 1;
      clipped(g5, left - 1, top - 1, shown - left + 1, tall + 2, paint2);
    } else paint2();
    if (store.view.selected.value === span.path) {
      g5.strokeStyle = this.colours.of("ink");
      g5.lineWidth = 2;
      g5.strokeRect(left - 1, top - 1, wide + 2, tall + 2);
    }
    const lit = store.pointer.hovered.value;
    if (lit?.path === span.path && lit.from === span.from) this.#halo(bar);
    if (span.serviced !== null && span.serviced <= now) this.#mark(Math.min(x3(span.serviced), right), bar, "preempted");
    if (span.abandoned !== null && span.abandoned <= now)
      this.#mark(Math.min(x3(span.abandoned), right), bar, "failure");
    const words2 = wordsOf(node.name, span, now === Infinity ? span.to ?? store.playback.nowMs() : now);
    const above = store.data.scene.colourOf(span.path) < 0 ? bottom : bottom - TRACK;
    this.#text(words2, `${kind}-text`, { ...bar, bottom: above });
  }
  /** @param asked where the hatch of a request to stop begins [px] */
  #body({ span, ...bar }, kind, asked2) {
    const g5 = this.context;
    const { left, right, top, bottom } = bar;
    g5.fillStyle = this.colours.of(`${kind}-fill`);
    g5.strokeStyle = this.colours.of(kind);
    g5.lineWidth = 1.1;
    this.#outline(bar);
    g5.fill();
    if (asked2 !== null) {
      g5.save();
      g5.clip();
      g5.fillStyle = this.colours.of("preempted");
      g5.globalAlpha *= 0.55;
      for (let px = Math.max(left, asked2); px < right; px += 5) g5.fillRect(px, top, 2.5, bottom - top);
      g5.restore();
    }
    g5.stroke();
    const driver = store.data.scene.colourOf(span.path);
    if (driver < 0) return;
    g5.fillStyle = this.colours.of(`s${1 + driver % COLOURS}`);
    g5.fillRect(left + 2, bottom - TRACK - 0.5, Math.max(0, right - left - 4), TRACK);
  }
  /** Draw the times in which the lane's states were paused before they began, or asked. */
  #waits(lane, y5, lanes, model, axis) {
    const { from, to, left, right } = axis;
    const x3 = (t4) => axis.x(t4);
    const now = store.playback.nowMs();
    for (const wait of store.data.run.waits) {
      const until = Math.min(wait.to ?? now, now);
      if (until < from || wait.from > Math.min(to, now)) continue;
      const node = model.get(wait.path);
      if (!node || node.parent?.path !== lane.path) continue;
      const begin = Math.max(left, x3(wait.from));
      const end = Math.max(Math.min(right + 2, x3(until)), begin + 2);
      const bar = { left: begin, right: end, ...rowOf(lanes, lane, node, wait.from, y5) };
      const asks2 = wait.kind === "asks";
      this.#wait(bar, asks2);
      const words2 = asks2 ? `${node.name} ?` : wait.text;
      const took = duration(Math.max(0, until - wait.from) / 1e3);
      this.#text([`${words2} ${took}`, words2, asks2 ? "?" : ""], asks2 ? "waiting-text" : "other-text", bar);
    }
  }
  /** Draw a wait: dotted for a question, hatched for a pause. */
  #wait(bar, asks2) {
    const g5 = this.context;
    const colour = asks2 ? "waiting" : "other";
    const tall = bar.bottom - bar.top;
    g5.save();
    this.#outline(bar);
    g5.fillStyle = this.colours.of(`${colour}-fill`);
    g5.fill();
    g5.clip();
    g5.strokeStyle = this.colours.of(colour);
    if (!asks2) {
      g5.globalAlpha = 0.35;
      g5.lineWidth = 2;
      for (let px = bar.left - tall; px < bar.right; px += 7) {
        g5.beginPath();
        g5.moveTo(px, bar.bottom);
        g5.lineTo(px + tall, bar.top);
        g5.stroke();
      }
    }
    g5.restore();
    this.#outline(bar);
    g5.strokeStyle = this.colours.of(colour);
    g5.setLineDash(asks2 ? [1.5, 2.5] : []);
    g5.lineWidth = 1.4;
    g5.stroke();
    g5.setLineDash([]);
  }
  #outline({ left, right, top, bottom }) {
    const [wide, tall] = [right - left, bottom - top];
    this.context.beginPath();
    this.context.roundRect(left, top, wide, tall, Math.min(4, tall / 2, wide / 2));
  }
  /** Draw a ring around the visit that the pointer is on here or in the map. */
  #halo({ left, right, top, bottom }) {
    const g5 = this.context;
    for (const [name, wide] of [
      ["ink", 4.5],
      ["halo", 2.5]
    ]) {
      g5.strokeStyle = this.colours.of(name);
      g5.lineWidth = wide;
      g5.beginPath();
      g5.roundRect(left - 1, top - 1, right - left + 2, bottom - top + 2, 4);
      g5.stroke();
    }
  }
  /** Mark the place at which a preempt was serviced or the state was abandoned. */
  #mark(px, { top, bottom }, colour) {
    const g5 = this.context;
    g5.fillStyle = this.colours.of(colour);
    g5.beginPath();
    g5.moveTo(px - 3.5, top - 1);
    g5.lineTo(px + 3.5, top - 1);
    g5.lineTo(px, top + 5);
    g5.fill();
    g5.fillRect(px - 0.75, top, 1.5, bottom - top);
  }
  /**
   * Write the longest of several texts that fits into a bar, or the beginning of the shortest.
   * @param texts the longest first
   */
  #text(texts, colour, { left, right, top, bottom }) {
    const [wide, tall] = [right - left, bottom - top];
    if (wide <= 14 || tall <= 9) return;
    const g5 = this.context;
    const size = tall > 13 ? 11 : 9.5;
    g5.font = `${size}px Inter, Arial, sans-serif`;
    const widthOf = (one) => this.#widthOf(one, size);
    const whole2 = texts.find((one) => widthOf(one) <= wide - 8);
    const shown = whole2 ?? beginningOf(texts.at(-1) ?? "", wide - 8, widthOf);
    g5.fillStyle = this.colours.of(colour);
    g5.textAlign = "left";
    if (shown) clipped(g5, left, top, wide - 3, tall, () => g5.fillText(shown, left + 4, top + tall / 2 + 0.5));
    g5.font = FONT;
  }
  /** @param size of the font, which is set [px] */
  #widthOf(text2, size) {
    const key = `${size} ${text2}`;
    let width = this.#widths.get(key);
    if (width === void 0) {
      width = this.context.measureText(text2).width;
      if (this.#widths.size > MOST_WIDTHS) this.#widths.clear();
      this.#widths.set(key, width);
    }
    return width;
  }
};
function beginningOf(text2, width, widthOf) {
  let length = Math.min(text2.length - 1, Math.ceil(text2.length * width / widthOf(text2)) + 1);
  for (; length >= LEAST_LETTERS; length--) {
    const short = `${text2.slice(0, length).replace(/[\s.,(]+$/, "")}…`;
    if (widthOf(short) <= width) return short;
  }
  return "";
}
function rowOf(lanes, lane, node, t4, y5) {
  const rows = lanes.rowsOf(lane);
  const pitch = (lanes.heightOf(lane) - 3) / rows;
  const top = y5 + 1.5 + (rows > 1 ? lanes.rowAt(lane, node, t4) : 0) * pitch;
  return { top, bottom: top + Math.max(1, pitch - (rows > 1 ? Math.min(1.5, pitch / 4) : 0)) };
}
function clipped(g5, x3, y5, w5, h5, paint2) {
  g5.save();
  g5.beginPath();
  g5.rect(x3, y5, w5, h5);
  g5.clip();
  paint2();
  g5.restore();
}

// src/drawing/lanes.ts
var LANE = 19;
var ROW = 13;
var MOST_ROWS = 8;
var Lanes = class {
  all = [];
  // in the order of the tree
  #spansOf = /* @__PURE__ */ new Map();
  // by path of the lane
  #model = null;
  #spans = null;
  #sorted = 0;
  // number of spans that are in lanes
  #planRows = /* @__PURE__ */ new Map();
  // the newest span of each row, by path of a plan
  #rowOf = /* @__PURE__ */ new Map();
  // of the actions of plans
  forget() {
    this.#model = null;
  }
  /** Put new spans into lanes; a container gets a lane when a state in it has run. */
  update(model, spans) {
    if (this.#model !== model || this.#spans !== spans) {
      this.#spansOf.clear();
      this.#planRows.clear();
      this.#rowOf.clear();
      this.#sorted = 0;
      this.all = [];
    }
    this.#model = model;
    this.#spans = spans;
    const before = this.#spansOf.size;
    for (; this.#sorted < spans.length; this.#sorted++) {
      const span = spans[this.#sorted];
      const container = model.get(span.path)?.parent;
      if (!container) continue;
      const lane = container.path;
      if (container.kind === "plan") this.#placeInPlan(lane, span);
      const known2 = this.#spansOf.get(lane);
      if (known2) known2.push(span);
      else this.#spansOf.set(lane, [span]);
    }
    if (this.#spansOf.size !== before) this.all = model.order.filter((node) => this.#spansOf.has(node.path));
  }
  /** Actions of a plan that run at the same time get rows of their own. */
  #placeInPlan(lane, span) {
    const rows = this.#planRows.get(lane) ?? [];
    this.#planRows.set(lane, rows);
    const free = rows.findIndex((last) => last.to !== null && last.to <= span.from);
    const row = free < 0 ? rows.length : free;
    rows[row] = span;
    this.#rowOf.set(span, row);
  }
  /** The number of a lane's rows. */
  rowsOf(lane) {
    if (lane.kind === "concurrence") return lane.children.length;
    return this.#planRows.get(lane.path)?.length ?? 1;
  }
  /** The row of a state in its lane, at an instant [ms]. */
  rowAt(lane, node, t4) {
    if (lane.kind === "concurrence") return lane.children.indexOf(node);
    if (!this.#planRows.has(lane.path)) return 0;
    const span = this.#spansOf.get(lane.path)?.findLast((one) => one.path === node.path && one.from <= t4);
    return (span && this.#rowOf.get(span)) ?? 0;
  }
  /** [px] */
  heightOf(lane) {
    const rows = this.rowsOf(lane);
    return rows > 1 || lane.kind === "concurrence" ? Math.max(LANE, ROW * Math.min(rows, MOST_ROWS) + 3) : LANE;
  }
  /** Of several lanes [px]. */
  totalOf(lanes) {
    return lanes.reduce((sum, lane) => sum + this.heightOf(lane), 0);
  }
  /**
   * The spans of a lane in a range [ms], in order of their beginnings. Ends are only roughly in that order, so a few
   * that ended before the range are among them.
   */
  spansIn(lane, from, to) {
    const spans = this.#spansOf.get(lane.path) ?? [];
    const ended = countWhile(spans, (span) => (span.to ?? Infinity) < from);
    const begun = countWhile(spans, (span) => span.from <= to);
    return spans.slice(Math.max(0, ended - 16), begun);
  }
  /**
   * The lanes to show: of those with one of some words in a name, all if there is room, otherwise those with spans in a
   * range [ms].
   * @param words separated by spaces or commas; without any, all lanes count
   * @param room [px]
   */
  shown({ from, to }, words2, room) {
    const wanted = words2.toLowerCase().split(/[\s,]+/).filter(Boolean);
    const isWanted = (lane) => [lane, ...lane.children].some(({ path }) => isNamed(path, wanted));
    const lanes = wanted.length ? this.all.filter(isWanted) : this.all;
    if (this.totalOf(lanes) <= room) return lanes;
    return lanes.filter((lane) => this.spansIn(lane, from, to).some((span) => (span.to ?? Infinity) >= from));
  }
};
var isNamed = (path, words2) => {
  const name = path.slice(path.lastIndexOf("/") + 1).toLowerCase();
  return words2.some((word) => name.includes(word));
};

// src/drawing/timeline_marks.ts
var NOTE = 130;
function drawOutages(g5, colours, axis, height) {
  const gaps2 = [];
  for (const [begin, end] of store.data.run.now.outages ?? []) {
    if (end / 1e6 < axis.from || begin / 1e6 > axis.to) continue;
    const left = Math.max(axis.left, axis.x(begin / 1e6));
    const right = Math.min(axis.right, Math.max(axis.x(end / 1e6), left + 3));
    if (right <= left) continue;
    gaps2.push([left, right]);
    g5.fillStyle = colours.of("background");
    g5.fillRect(left, 0, right - left, height);
    g5.strokeStyle = colours.of("waiting");
    g5.lineWidth = 1.5;
    g5.setLineDash([2, 3]);
    for (const px of [left, right]) {
      g5.beginPath();
      g5.moveTo(px, 0);
      g5.lineTo(px, height);
      g5.stroke();
    }
    g5.setLineDash([]);
    const text2 = duration((end - begin) / 1e9);
    if (g5.measureText(text2).width + 8 > right - left || axis.foldAt((left + right) / 2)) continue;
    g5.fillStyle = colours.of("waiting-text");
    g5.textAlign = "center";
    g5.fillText(text2, (left + right) / 2, 10);
  }
  return gaps2;
}
function drawFold(g5, colours, { from, to }, axis, height) {
  const left = Math.max(axis.left, axis.x(from));
  const right = Math.min(axis.right, axis.x(to));
  const middle = (left + right) / 2;
  g5.fillStyle = colours.of("depth2");
  g5.fillRect(left, 0, right - left, height);
  g5.strokeStyle = colours.of("muted");
  g5.lineWidth = 1.2;
  g5.beginPath();
  for (let y5 = 0, side = -1; y5 <= height; y5 += 5, side = -side) g5.lineTo(middle + 3 * side, y5);
  g5.stroke();
  const text2 = duration((to - from) / 1e3);
  const half = g5.measureText(text2).width / 2 + 5;
  const at = Math.max(axis.left + half, Math.min(axis.right - half, middle));
  g5.beginPath();
  g5.roundRect(at - half, height / 2 - 9, 2 * half, 18, 9);
  g5.fillStyle = colours.of("background");
  g5.fill();
  g5.stroke();
  g5.fillStyle = colours.of("ink");
  g5.textAlign = "center";
  g5.fillText(text2, at, height / 2 + 0.5);
}
function drawNotes(g5, colours, axis, height) {
  const { left: first, right: last } = axis;
  for (const { at, text: text2 } of pins()) {
    const px = axis.x(at);
    if (px < first || px > last) continue;
    g5.fillStyle = colours.of("ink");
    g5.fillRect(px - 0.5, 0, 1, height);
    const wide = Math.min(NOTE, g5.measureText(text2).width + 10);
    const left = px + wide > last ? px - wide : px;
    const top = height - 16;
    g5.beginPath();
    g5.roundRect(left, top, wide, 15, 3);
    g5.fill();
    g5.fillStyle = colours.of("background");
    g5.textAlign = "left";
    clipped(g5, left, top, wide - 4, 15, () => g5.fillText(text2, left + 5, top + 8));
  }
}
function describe(span) {
  const { from, to, preempt, serviced, abandoned } = span;
  const purpose = purposeOfVisit(span);
  const seconds = (some) => `${(some / 1e3).toFixed(3)} s`;
  const lines = [
    purpose ? `${span.path} → ${purpose}` : span.path,
    to === null ? "runs" : `${seconds(to - from)}, ${span.outcome ?? "its end is unknown"}`
  ];
  if (span.attempt) lines.push(`attempt ${span.attempt}`);
  if (preempt !== null) {
    lines.push(`asked to stop after ${seconds(preempt - from)} by ${askerText(span.asked) ?? "?"}`);
    if (serviced !== null) lines.push(`preempt serviced ${seconds(serviced - preempt)} later`);
    if (abandoned !== null) lines.push(`abandoned ${seconds(abandoned - preempt)} later`);
  }
  return lines.join("\n");
}

// src/drawing/timeline.ts
var NAMES2 = 168;
var NAMES_NARROW = 84;
var TOOLS_NARROW = 176;
var RIGHT2 = 14;
var TOP = 3;
var FOOT = 26;
var FLAG = "600 11px 'JetBrains Mono', ui-monospace, monospace";
var STEPS_S = [
  ...[1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5],
  ...[1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600, 7200, 14400]
];
var Timeline = class {
  canvas;
  context;
  onPick;
  onDraw;
  window = new TimeWindow();
  lanes = new Lanes();
  bars;
  top = 0;
  // vertical scroll [px]
  names = NAMES2;
  // width of the lanes' names [px]
  scale = null;
  // of the last drawing
  tallest = 0;
  // height of all lanes and the axis [px]
  gaps = [];
  // outages [px]
  #colours = new Colours();
  constructor(canvas2, { onPick, onDraw }) {
    this.canvas = canvas2;
    this.context = canvas2.getContext("2d");
    this.bars = new Bars(this.context, this.#colours);
    this.onPick = onPick;
    this.onDraw = onDraw;
    canvas2.addEventListener("pointerdown", (e4) => this.#down(e4));
    canvas2.addEventListener("wheel", (e4) => this.#wheel(e4), { passive: false });
    canvas2.addEventListener("pointermove", (e4) => {
      const span = this.#spanAt(e4);
      const fold = this.#foldAt(e4);
      canvas2.title = fold ? `nothing happened for ${duration((fold.to - fold.from) / 1e3)}: click to unfold it` : span ? describe(span) : "";
      store.pointer.hover(span ? { path: span.path, from: span.from } : null);
      this.#hover(e4.offsetX);
    });
    canvas2.addEventListener("pointerleave", () => {
      this.#hover(null);
      store.pointer.hover(null);
    });
    canvas2.addEventListener("keydown", (e4) => this.#key(e4));
    canvas2.addEventListener("dblclick", (e4) => {
      const span = this.#spanAt(e4);
      if (!span) return;
      this.window.fit(span.from, span.to ?? store.playback.nowMs());
      this.draw();
    });
  }
  /** Read the colours again. */
  restyle() {
    this.#colours.forget();
  }
  reset() {
    this.window.reset();
    this.lanes.forget();
    this.top = 0;
  }
  /** Follow the present. */
  live() {
    this.window.end = null;
    store.playback.seek(null);
  }
  /** Tell screen readers the instant shown, as the value of a slider [s]. */
  tellInstant() {
    const began = store.playback.began() ?? 0;
    const seconds = (t4) => String(Math.max(0, Math.round((t4 - began) / 1e3)));
    this.canvas.setAttribute("aria-valuemin", "0");
    this.canvas.setAttribute("aria-valuemax", seconds(store.data.liveMs()));
    this.canvas.setAttribute("aria-valuenow", seconds(store.playback.nowMs()));
    this.canvas.setAttribute("aria-valuetext", store.clock.instantText(store.playback.nowMs()));
  }
  // -- drawing ----------------------------------------------------------------------------------
  draw() {
    const g5 = this.context;
    const model = store.data.model.value;
    const size = fitted(g5);
    if (!size || !model) return;
    const { width, height } = size;
    const room = height - FOOT;
    this.names = width < 640 ? NAMES_NARROW : NAMES2;
    g5.clearRect(0, 0, width, height);
    g5.font = FONT;
    g5.textBaseline = "middle";
    this.window.keepInView();
    const scale = this.window.axis(this.names, width - RIGHT2);
    const { from, to } = scale;
    this.scale = scale;
    this.#grid(scale, width, height);
    this.lanes.update(model, store.data.run.spans);
    this.#fitHeight();
    const lanes = this.lanes.shown(scale, store.view.laneFilter.value, room);
    this.top = Math.max(0, Math.min(this.top, this.lanes.totalOf(lanes) - room));
    let y5 = TOP - this.top;
    this.bars.forget();
    clipped(g5, 0, 0, width, room, () => {
      for (const lane of lanes) {
        const tall = this.lanes.heightOf(lane);
        if (y5 + tall > 0 && y5 < room) this.bars.lane(lane, y5, this.lanes, model, scale);
        y5 += tall;
      }
    });
    this.gaps = drawOutages(g5, this.#colours, scale, room);
    for (const fold of scale.folds) drawFold(g5, this.#colours, fold, scale, room);
    this.#stretch(scale, height);
    drawNotes(g5, this.#colours, scale, room);
    this.#cursor(scale, height);
    this.onDraw({ from, to });
  }
  /** Tell the page the height of all lanes and the axis: more is left to the plots. */
  #fitHeight() {
    const tallest = TOP + this.lanes.totalOf(this.lanes.all) + FOOT;
    if (tallest === this.tallest) return;
    this.tallest = tallest;
    document.documentElement.style.setProperty("--lanes", `${tallest}px`);
  }
  #grid(axis, width, height) {
    const { from, to } = axis;
    const g5 = this.context;
    const first = store.data.run.first();
    if (first === null) return;
    const begun = ms(store.playback.shown().started) ?? first;
    const step = 1e3 * (STEPS_S.find((s4) => s4 * 1e3 * axis.rate > 74) ?? 86400 * Math.ceil(74 / axis.rate / 864e5));
    g5.fillStyle = this.#colours.of("muted");
    g5.strokeStyle = this.#colours.of("hair");
    g5.textAlign = "left";
    g5.lineWidth = 1;
    const next = (t4) => begun + Math.ceil((t4 - begun) / step) * step;
    const digits = Math.max(0, Math.ceil(3 - Math.log10(step)));
    const shown = store.playback.cursor.value;
    const flag = shown === null ? null : this.#flagBox(inside(axis, shown), shown);
    let free = this.names === NAMES_NARROW ? TOOLS_NARROW : 0;
    for (let t4 = next(from); t4 < to; t4 += step) {
      const fold = axis.folds.find((one) => one.from < t4 && one.to > t4);
      if (fold) t4 = next(fold.to);
      const px = Math.round(axis.x(t4)) + 0.5;
      g5.beginPath();
      g5.moveTo(px, 0);
      g5.lineTo(px, height - FOOT);
      g5.stroke();
      const text2 = store.clock.instantText(t4, digits);
      const end = px + 3 + g5.measureText(text2).width;
      const isCovered = flag !== null && px < flag.right && end > flag.left;
      if (t4 < first || px < free || end > width || isCovered) continue;
      g5.fillText(text2, px + 3, height - FOOT / 2);
      free = end + 4;
    }
  }
  /** Draw the selected stretch. */
  #stretch(axis, height) {
    const found = store.playback.stretch.value;
    if (!found) return;
    const g5 = this.context;
    const [left, right] = [found.from, found.to].map((t4) => Math.max(axis.left, axis.x(t4)));
    g5.fillStyle = this.#colours.of("ink");
    g5.globalAlpha = 0.1;
    g5.fillRect(left, 0, right - left, height - FOOT);
    g5.globalAlpha = 1;
    for (const px of [left, right]) g5.fillRect(px - 0.75, 0, 1.5, height - FOOT);
    g5.fillRect(left, height - FOOT, right - left, store.playback.looping.value ? 4 : 2);
  }
  /** Draw the instants at the pointer and shown. */
  #cursor(axis, height) {
    const at = store.playback.cursor.value;
    const pointed = store.pointer.pointed.value;
    if (pointed !== null && axis.x(pointed) >= axis.left) this.#flag(axis.x(pointed), pointed, height, "muted", 1);
    if (at !== null) this.#flag(inside(axis, at), at, height, "active", 2);
  }
  /** Draw a line through the lanes, with its instant at the axis. */
  #flag(px, t4, height, colour, wide) {
    const g5 = this.context;
    const { left, right } = this.#flagBox(px, t4);
    g5.font = FLAG;
    g5.fillStyle = this.#colours.of(colour);
    g5.fillRect(px - wide / 2, 0, wide, height - FOOT);
    g5.beginPath();
    g5.roundRect(left, height - FOOT + 3, right - left, FOOT - 6, 4);
    g5.fill();
    g5.fillStyle = this.#colours.of("background");
    g5.textAlign = "center";
    g5.fillText(store.clock.instantText(t4), (left + right) / 2, height - FOOT / 2 + 0.5);
    g5.font = FONT;
  }
  /** The ends of the flag with an instant, at the axis [px]. */
  #flagBox(px, t4) {
    this.context.font = FLAG;
    const half = this.context.measureText(store.clock.instantText(t4)).width / 2 + 5;
    this.context.font = FONT;
    const middle = Math.max(this.names + half, Math.min(this.canvas.clientWidth - half, px));
    return { left: middle - half, right: middle + half };
  }
  // -- input ------------------------------------------------------------------------------------
  #timeAt(px) {
    return this.window.axis(this.names, this.canvas.clientWidth - RIGHT2).timeAt(px);
  }
  #hover(px) {
    store.pointer.pointed.value = px !== null && px >= this.names ? this.#timeAt(px) : null;
  }
  #spanAt(e4) {
    const box = this.canvas.getBoundingClientRect();
    const [px, py] = [e4.clientX - box.left, e4.clientY - box.top];
    const hit = this.bars.hits.findLast((h5) => px >= h5.left - 1 && px <= h5.right + 1 && py >= h5.top && py <= h5.bottom);
    return hit?.span ?? null;
  }
  /** The folded idle time below the pointer; null for none, and at the axis. */
  #foldAt(e4) {
    return e4.offsetY < this.canvas.clientHeight - FOOT ? this.scale?.foldAt(e4.offsetX) ?? null : null;
  }
  #down(e4) {
    const { left, bottom } = this.canvas.getBoundingClientRect();
    const from = e4.clientX - left;
    if (e4.button !== 0 || from < this.names) return;
    const selects = e4.pointerType === "mouse" && e4.clientY < bottom - FOOT;
    const begin = this.#timeAt(from);
    const span = this.#spanAt(e4);
    const fold = this.#foldAt(e4);
    let dragged = false;
    this.window.hold();
    const seek = (m5) => store.playback.seek(Math.min(this.#timeAt(m5.clientX - left), store.data.run.last() ?? Infinity));
    const move = (m5) => {
      if (Math.abs(m5.clientX - left - from) > 3) dragged = true;
      if (dragged && selects) store.playback.selectStretch(begin, this.#timeAt(m5.clientX - left));
      else if (dragged || !span && !selects) seek(m5);
    };
    drag(move, (m5) => {
      if (dragged && selects) return;
      if (!dragged && fold) {
        store.clock.unfold(fold);
        return;
      }
      seek(m5);
      if (!dragged && span) this.onPick(span.path);
    });
  }
  #wheel(e4) {
    e4.preventDefault();
    if (e4.shiftKey || !e4.ctrlKey && e4.deltaX === 0 && e4.offsetX < this.names) this.top += e4.deltaY || e4.deltaX;
    else this.#zoom(e4);
    this.draw();
  }
  #zoom(e4) {
    if (Math.abs(e4.deltaX) > Math.abs(e4.deltaY)) this.window.move(e4.deltaX / this.canvas.clientWidth);
    else this.window.zoom(Math.exp(e4.deltaY * 16e-4), this.#timeAt(e4.offsetX));
  }
  #key(e4) {
    const step = { ArrowLeft: -1, ArrowRight: 1, PageUp: -20, PageDown: 20 }[e4.key];
    if (step !== void 0) {
      store.playback.seekEvent(step);
      e4.stopPropagation();
    } else if (e4.key === "End") this.live();
    else if (e4.key === "Home") store.playback.seek(store.data.run.first());
    else return;
    e4.preventDefault();
  }
};
var inside = (axis, t4) => Math.max(axis.left, Math.min(axis.right, axis.x(t4)));

// src/drawing/page.ts
var Page = class {
  map;
  diagram;
  minimap;
  view;
  timeline;
  strip;
  plots = /* @__PURE__ */ new Set();
  painter;
  layouts;
  scheduler;
  address = new Address();
  #hovered = null;
  // path of the state in the diagram that the pointer is on
  #followIsSet = false;
  /**
   * @param canvas of the timeline
   * @param floor of the map
   * @param whole of the strip over the whole run
   */
  constructor(svg2, minimap2, canvas2, floor3, whole2) {
    this.map = new MapView(floor3);
    this.minimap = new Minimap(minimap2, (x3, y5) => this.view.centre(x3, y5));
    this.diagram = new Diagram(svg2, (path, active) => this.minimap.light(path, active));
    this.view = new Viewport(svg2, this.diagram.world, () => {
      this.minimap.showWindow(this.view);
      this.diagram.showScale(this.view.k);
      store.view.scale.value = this.view.k;
    });
    this.timeline = new Timeline(canvas2, {
      onPick: (path) => this.goTo(path),
      onDraw: (range) => {
        for (const plot of this.plots) plot.draw(range);
        this.strip.left = this.timeline.names;
        this.strip.shown = range;
        this.strip.draw();
      }
    });
    this.strip = new Strip(whole2, (range) => {
      if (range) this.timeline.window.show(range);
      else this.timeline.window.fitAll();
      this.timeline.draw();
    });
    this.painter = new Painter(this.diagram);
    this.layouts = new LayoutController(this.diagram, this.minimap, this.view, this.painter);
    this.scheduler = new Scheduler({
      painter: this.painter,
      timeline: this.timeline,
      map: this.map,
      minimap: this.minimap,
      onPanels: () => this.layouts.follow()
    });
    this.#listen(svg2, canvas2);
    this.#subscribe();
  }
  /** Listen to the user and to the browser. */
  #listen(svg2, canvas2) {
    svg2.addEventListener("click", (e4) => {
      if (!this.view.moved) this.select(pathOf(e4));
    });
    svg2.addEventListener("pointermove", (e4) => e4.buttons || this.#hover(pathOf(e4)));
    svg2.addEventListener("pointerleave", () => this.#hover(null));
    svg2.addEventListener("dblclick", (e4) => this.layouts.toggle(pathOf(e4)));
    new ResizeObserver(() => {
      this.layouts.resized();
      this.timeline.draw();
    }).observe(svg2);
    new ResizeObserver(() => this.timeline.draw()).observe(canvas2);
    const phone = matchMedia("(max-width: 720px), (max-height: 480px)");
    const look = () => {
      store.view.isPhone.value = phone.matches;
    };
    phone.addEventListener("change", look);
    look();
    addEventListener("hashchange", () => {
      readToken();
      this.address.read();
      this.address.show(() => this.timeline.window.fitAll());
      this.layouts.refit();
    });
    systemIsDark.addEventListener("change", () => this.#restyle());
  }
  /** Draw what changes in the store. */
  #subscribe() {
    const { data, view: view2, playback, pointer, clock, notes } = store;
    for (const one of [
      notes.all,
      clock.chosen,
      clock.foldsIdle,
      clock.unfolded,
      view2.laneFilter,
      pointer.pointed,
      playback.stretch
    ])
      one.subscribe(() => this.timeline.draw());
    playback.instant.subscribe(() => {
      this.painter.paintAll();
      this.timeline.draw();
      this.map.draw();
    });
    pointer.hovered.subscribe((visit) => {
      this.diagram.mark(visit ? [visit.path] : [], "linked");
      this.timeline.draw();
      this.map.draw();
    });
    for (const one of [data.serversSeen, data.facts]) one.subscribe(() => this.painter.paintAll());
    data.wayShown.subscribe(() => this.#showWay());
    newest2.subscribe(() => {
      const path = reproduction()?.found?.difference?.path;
      if (path && view2.reveal(path)) this.layouts.refit();
      this.painter.paintAll();
      this.timeline.draw();
    });
  }
  /** Begin; the elements must be in the document, so that the browser loads their fonts. */
  async start() {
    this.scheduler.start();
    this.layouts.start(await makeWorker("elk"));
    await document.fonts.ready;
    await connect({
      onEvents: (events) => this.scheduler.takeEvents(events),
      onMachine: () => this.showMachine(),
      onObserved: (records) => this.scheduler.takeObserved(records),
      onView: (fragment) => this.address.read(fragment)
    });
  }
  /** Show the machine in the store. */
  showMachine() {
    store.view.selected.value = null;
    this.layouts.restart();
    this.timeline.reset();
    store.notes.load();
    store.panels.loadPlots();
    this.map.reset();
    if (isFile() || store.data.facts.value?.recorded || store.data.run.now.ended != null) this.timeline.window.fitAll();
    if (store.data.settings.value.follow && !this.#followIsSet) {
      store.view.follow.value = true;
      this.#followIsSet = true;
    }
    this.address.show(() => this.timeline.window.fitAll());
    this.layouts.refit();
  }
  /** Open the containers on the way to the end of the run, and highlight that way. */
  #showWay() {
    const way = store.data.wayShown.value;
    const closed = way.map(({ path }) => store.view.reveal(path)).some(Boolean);
    if (closed) this.layouts.refit();
    else if (this.diagram.size) this.diagram.showWay(way);
  }
  /** The title of the view, for a picture. */
  title() {
    return store.data.facts.value?.label ?? "";
  }
  /** A file name for the view, without an extension. */
  fileName() {
    return `${this.title()} ${store.clock.instantText(store.playback.nowMs())}`.replace(/[^\p{L}\p{N}._-]+/gu, "-");
  }
  // -- states -----------------------------------------------------------------------------------
  /** Set the state of the diagram that the pointer is on: its visit is highlighted everywhere. */
  #hover(path) {
    if (path !== this.#hovered) store.pointer.hoverAt(path);
    this.#hovered = path;
  }
  select(path) {
    store.view.selected.value = path;
    this.diagram.mark(path ? [path] : [], "selected");
    this.timeline.draw();
  }
  /** Select a state and bring it into view. */
  goTo(path) {
    showPage("machine");
    this.select(path);
    store.view.part.value = "machine";
    if (store.view.reveal(path)) this.layouts.relayout({ focus: path });
    else this.layouts.focus(path);
  }
  /** Select the neighbour of the selected state in a direction. */
  selectNeighbour(dx, dy) {
    const from = this.diagram.boxOf(store.view.selected.value);
    if (!from) return;
    const centre = (b3) => ({ x: b3.x + b3.w / 2, y: b3.y + Math.min(b3.h, 30) / 2 });
    const here = centre(from);
    let best = null;
    for (const [path, box] of this.diagram.picture.boxes) {
      if (path === store.view.selected.value) continue;
      const there = centre(box);
      const along = (there.x - here.x) * dx + (there.y - here.y) * dy;
      const aside = Math.abs((there.x - here.x) * dy) + Math.abs((there.y - here.y) * dx);
      const far = along + 2 * aside;
      if (along > 4 && (!best || far < best.far)) best = { path, far };
    }
    if (best) this.select(best.path);
  }
  markHits(paths) {
    this.diagram.mark(paths, "hit");
  }
  // -- how it looks -----------------------------------------------------------------------------
  /** @param mode a key of statistics.MODES */
  setNumbers(mode) {
    store.view.numbers.value = mode;
    this.painter.showNumbers();
  }
  setTheme(name) {
    store.view.theme.value = name;
    applyTheme();
    this.#restyle();
  }
  #restyle() {
    this.timeline.restyle();
    this.strip.restyle();
    for (const plot of this.plots) plot.restyle();
    this.map.restyle();
    this.timeline.draw();
    this.map.draw();
  }
  addPlot(plot) {
    this.plots.add(plot);
    this.timeline.draw();
  }
  removePlot(plot) {
    this.plots.delete(plot);
    plot.destroy();
  }
};
var pathOf = (e4) => e4.target instanceof Element ? e4.target.closest("[data-path]")?.getAttribute("data-path") ?? null : null;

// src/core/goal_values.ts
var NUMBER = /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i;
var SPECIAL = {
  nan: ".nan",
  ".nan": ".nan",
  inf: ".inf",
  "+inf": ".inf",
  ".inf": ".inf",
  infinity: ".inf",
  "-inf": "-.inf",
  "-.inf": "-.inf",
  "-infinity": "-.inf"
};
var UNPRINTABLE2 = /[\u007f-\u009f\u2028\u2029\ufeff\ufffe\uffff]/g;
var isOneText = (field) => Boolean(field.array) && !["string", "message"].includes(field.kind);
var textIn = (value) => Array.isArray(value) ? value.join(", ") : String(value);
var listIn = (value) => Array.isArray(value) ? value : [];
var treeIn = (value) => typeof value === "object" && value !== null && !Array.isArray(value) ? value : {};
function toState(fields2, values) {
  return Object.fromEntries(fields2.map((field) => [field.name, stateOf2(field, values[field.name])]));
}
function stateOf2(field, value) {
  if (isOneText(field)) return textIn(value);
  const one = (item) => field.kind === "message" ? toState(field.fields ?? [], treeIn(item)) : item;
  return field.array ? listIn(value).map(one) : one(value);
}
function toYaml(fields2, state) {
  return `{${fields2.map((field) => `${field.name}: ${yamlOf(field, state[field.name])}`).join(", ")}}`;
}
function yamlOf(field, value) {
  if (isOneText(field))
    return `[${items2(textIn(value)).map((text2) => scalar(field.kind, text2)).join(", ")}]`;
  const one = (item) => field.kind === "message" ? toYaml(field.fields ?? [], treeIn(item)) : scalar(field.kind, item);
  return field.array ? `[${listIn(value).map(one).join(", ")}]` : one(value);
}
function items2(text2) {
  const inner = text2.trim().replace(/^\[|\]$/g, "").trim();
  return inner ? inner.split(/\s*,\s*|\s+/) : [];
}
function scalar(kind, value) {
  if (kind === "string") return quoted2(value);
  const text2 = String(value).trim();
  if (kind === "bool") return ["true", "false"].includes(text2) ? text2 : quoted2(value);
  if (kind === "time") return text2 === "now" ? "now" : NUMBER.test(text2) ? time(text2) : quoted2(text2);
  if (kind === "integer" && /^[-+]?\d+$/.test(text2)) return BigInt(text2.replace("+", "")).toString();
  if (kind === "float" && Object.hasOwn(SPECIAL, text2.toLowerCase())) return SPECIAL[text2.toLowerCase()];
  return NUMBER.test(text2) && Number.isFinite(Number(text2)) ? decimal(text2) : quoted2(text2);
}
function decimal(text2) {
  const short = String(Number(text2));
  if (short.includes(".")) return short;
  return short.includes("e") ? short.replace("e", ".0e") : `${short}.0`;
}
function time(text2) {
  if (/e/i.test(text2)) return decimal(text2);
  const [whole2, part = ""] = text2.replace(/^[-+]/, "").split(".");
  let total2 = BigInt(whole2 || "0") * 1000000000n + BigInt(part.padEnd(9, "0").slice(0, 9));
  if (text2.startsWith("-")) total2 = -total2;
  let secs = total2 / 1000000000n;
  let nsecs = total2 % 1000000000n;
  if (nsecs < 0n) {
    secs -= 1n;
    nsecs += 1000000000n;
  }
  return `{secs: ${secs}, nsecs: ${nsecs}}`;
}
var quoted2 = (text2) => JSON.stringify(String(text2)).replace(UNPRINTABLE2, (c4) => `\\u${c4.charCodeAt(0).toString(16).padStart(4, "0")}`);
function problemOf(problems, path, field) {
  const its = problems.find((one) => one.path === path);
  if (its) return its.text;
  const item = field && isOneText(field) && problems.find((one) => one.path.startsWith(`${path}[`));
  return item ? `item ${Number(item.path.slice(path.length + 1, -1)) + 1}: ${item.text}` : null;
}
function problemsWithoutField(problems, fields2, state) {
  const shown = /* @__PURE__ */ new Set();
  const texts = [];
  const visit = (some, values, path) => {
    for (const field of some) {
      const at = `${path}.${field.name}`;
      shown.add(at);
      if (isOneText(field)) texts.push(`${at}[`);
      else if (field.array)
        for (const [i4, item] of listIn(values[field.name]).entries()) {
          shown.add(`${at}[${i4}]`);
          if (field.kind === "message") visit(field.fields ?? [], treeIn(item), `${at}[${i4}]`);
        }
      else if (field.kind === "message") visit(field.fields ?? [], treeIn(values[field.name]), at);
    }
  };
  visit(fields2, state, "$");
  return problems.filter(({ path }) => !shown.has(path) && !texts.some((start) => path.startsWith(start)));
}
function problemText(text2, value) {
  if (!text2.endsWith("got str")) return text2;
  const all = [...String(value)];
  const short = all.length > 40 ? `${all.slice(0, 40).join("")}…` : String(value);
  return text2.replace(/got str$/, () => String(value).trim() ? `got “${short}”` : "got nothing");
}

// node_modules/preact/jsx-runtime/dist/jsxRuntime.mjs
var f4 = /* @__PURE__ */ Symbol.for("pv");
var o4 = 0;
function a4(t4, e4, n3, u4, a5, i4) {
  e4 || (e4 = {});
  var c4, l4, p5 = e4;
  if ("ref" in p5 && "function" != typeof t4) for (l4 in p5 = {}, e4) "ref" == l4 ? c4 = e4[l4] : p5[l4] = e4[l4];
  var s4 = { type: t4, props: p5, key: n3, ref: c4, __k: null, __: null, __b: 0, __e: null, __c: null, constructor: f4, __v: --o4, __i: -1, __u: 0 };
  return (a5 || i4) && (s4.__source = a5, s4.__self = i4), n.vnode && n.vnode(s4), s4;
}

// src/panels/components.tsx
var Section = ({
  title,
  count,
  children
}) => /* @__PURE__ */ a4("section", { children: [
  /* @__PURE__ */ a4("h2", { children: [
    title,
    " ",
    count != null && /* @__PURE__ */ a4("span", { class: "number", children: count })
  ] }),
  children
] });
var StateLink = ({ path, page: page2, tabindex }) => /* @__PURE__ */ a4("button", { class: "link", tabindex, title: shorten(path, 400), onClick: () => page2.goTo(path), children: store.data.nameOf(path) });
var More = ({ left, onMore }) => left > 0 ? /* @__PURE__ */ a4("button", { class: "small", onClick: onMore, children: [
  "and ",
  left.toLocaleString("en"),
  " more"
] }) : null;
var Pill = ({ kind, children }) => /* @__PURE__ */ a4("span", { class: `pill-text ${kind}`, children });
var fieldValue = (e4) => e4.target.value;
var FOR_THE_PAGE = ["Escape", "?"];
function Dialog({
  label,
  class: name = "",
  onClose,
  children
}) {
  const box = T2(null);
  A2(() => {
    const dialog = box.current;
    const before = document.activeElement;
    dialog?.showModal();
    return () => {
      dialog?.close();
      if (before instanceof HTMLElement) before.focus();
    };
  }, []);
  const onCancel = (e4) => {
    e4.preventDefault();
    onClose();
  };
  const onClick = (e4) => e4.target === e4.currentTarget && onClose();
  const onKeyDown = (e4) => FOR_THE_PAGE.includes(e4.key) || e4.stopPropagation();
  return /* @__PURE__ */ a4(
    "dialog",
    {
      class: `card ${name}`,
      "aria-label": label,
      ref: box,
      onCancel,
      onClick,
      onKeyDown,
      children
    }
  );
}

// src/panels/goal_form.tsx
var MOST_ROWS2 = 200;
var FEW = 4;
function Fields({
  fields: fields2,
  path = "$",
  ...shared
}) {
  return /* @__PURE__ */ a4($, { children: fields2.map((field) => /* @__PURE__ */ a4(Field, { field, path: `${path}.${field.name}`, ...shared }, field.name)) });
}
function Field({ field, state, ...shared }) {
  const { path, problems, onChange } = shared;
  const value = state[field.name];
  const put2 = (changed) => {
    state[field.name] = changed;
    onChange();
  };
  if (field.array && !isOneText(field)) return /* @__PURE__ */ a4(Rows, { field, value: listIn(value), put: put2, ...shared });
  if (field.kind === "message") return /* @__PURE__ */ a4(Group, { field, name: field.name, state: treeIn(value), ...shared });
  const problem = problemOf(problems, path, field);
  return /* @__PURE__ */ a4("div", { class: `field ${problem ? "bad" : ""}`, children: [
    /* @__PURE__ */ a4("label", { for: path, children: field.name }),
    /* @__PURE__ */ a4(Type, { field }),
    /* @__PURE__ */ a4(Input, { field, value, put: put2, bad: Boolean(problem), ...shared }),
    /* @__PURE__ */ a4(Comment, { field, path }),
    /* @__PURE__ */ a4(Problem, { path, text: problem && problemText(problem, value) })
  ] });
}
var Type = ({ field }) => /* @__PURE__ */ a4("span", { class: "type", children: field.type });
function Comment({ field, path }) {
  const unit = { time: "seconds, or now", duration: "seconds" }[field.base];
  const notes = [field.comment, isOneText(field) && "separated by commas", unit].filter(Boolean);
  return notes.length ? /* @__PURE__ */ a4("small", { class: "comment", id: `${path}?`, children: notes.join("; ") }) : null;
}
var Problem = ({ path, text: text2 }) => text2 ? /* @__PURE__ */ a4("p", { class: "problem", id: `${path}!`, children: text2 }) : null;
function Input({
  field,
  path,
  value,
  put: put2,
  bad,
  disabled,
  label
}) {
  const isNumber2 = field.kind === "float" || field.kind === "integer";
  const shared = {
    id: path,
    disabled,
    "data-path": path,
    "aria-invalid": bad,
    "aria-label": label,
    "aria-describedby": `${path}? ${path}!`
  };
  const onCheck = (e4) => put2(e4.target.checked);
  if (field.kind === "bool" && !field.array)
    return /* @__PURE__ */ a4("input", { type: "checkbox", ...shared, checked: String(value) === "true", onChange: onCheck });
  const input = /* @__PURE__ */ a4(
    "input",
    {
      type: "text",
      ...shared,
      value: String(value),
      spellcheck: false,
      autocomplete: "off",
      inputmode: isNumber2 ? "decimal" : void 0,
      class: field.kind === "string" ? "" : "number-input",
      placeholder: field.array ? "empty" : "",
      onInput: (e4) => put2(fieldValue(e4))
    }
  );
  if (!field.choices.length || field.array) return input;
  return /* @__PURE__ */ a4("span", { class: "choice", children: [
    /* @__PURE__ */ a4(Constants, { field, value, put: put2, disabled }),
    input
  ] });
}
function Constants({
  field,
  value,
  put: put2,
  disabled
}) {
  const text2 = String(value).trim();
  const isKnown = field.choices.some((choice) => choice.value === text2);
  const onChange = (e4) => {
    if (fieldValue(e4) !== "") put2(fieldValue(e4));
  };
  return /* @__PURE__ */ a4(
    "select",
    {
      "aria-label": `constants for ${field.name}`,
      disabled,
      value: isKnown ? text2 : "",
      onChange,
      children: [
        !isKnown && /* @__PURE__ */ a4("option", { value: "", children: "another value" }),
        field.choices.map((choice) => {
          const comment = choice.comment ? ` – ${choice.comment}` : "";
          const text3 = `${choice.name} = ${choice.value}${comment}`;
          return /* @__PURE__ */ a4("option", { value: choice.value, title: choice.comment, children: text3 });
        })
      ]
    }
  );
}
function Group({
  field,
  name,
  state,
  after,
  ...shared
}) {
  const fields2 = field.fields ?? [];
  const isFew = fields2.length <= FEW && fields2.every((one) => one.kind === "float" && !one.array);
  const comment = field.comment || field.about;
  return /* @__PURE__ */ a4("fieldset", { class: `group-field ${isFew ? "few" : ""}`, children: [
    /* @__PURE__ */ a4("legend", { children: [
      name,
      " ",
      /* @__PURE__ */ a4(Type, { field }),
      after
    ] }),
    comment && /* @__PURE__ */ a4("small", { class: "comment", children: comment }),
    /* @__PURE__ */ a4(Problem, { path: shared.path, text: problemOf(shared.problems, shared.path) }),
    /* @__PURE__ */ a4("div", { class: "inside-group", children: /* @__PURE__ */ a4(Fields, { fields: fields2, state, ...shared }) }),
    !fields2.length && /* @__PURE__ */ a4("small", { class: "comment", children: "no fields" })
  ] });
}
function Rows({
  field,
  value,
  put: put2,
  ...shared
}) {
  const { path, problems, disabled } = shared;
  const isFixed = field.array?.length != null;
  const add = () => put2([...value, field.kind === "message" ? toState(field.fields ?? [], field.default ?? {}) : ""]);
  const remove = (i4) => /* @__PURE__ */ a4(
    "button",
    {
      type: "button",
      class: "small",
      disabled,
      "aria-label": `remove ${field.name} ${i4 + 1}`,
      onClick: () => put2(value.filter((_5, n3) => n3 !== i4)),
      children: "−"
    }
  );
  const inner = { ...field, array: null };
  const row = (item, i4) => {
    const at = { ...shared, path: `${path}[${i4}]` };
    const name = `${field.name} ${i4 + 1}`;
    const after = isFixed ? null : remove(i4);
    if (field.kind === "message")
      return /* @__PURE__ */ a4(Group, { field: inner, name, state: treeIn(item), after, ...at }, i4);
    const problem = problemOf(problems, at.path);
    const putItem = (text2) => put2(value.map((old, n3) => n3 === i4 ? text2 : old));
    return /* @__PURE__ */ a4("div", { class: `field row-field ${problem ? "bad" : ""}`, children: [
      /* @__PURE__ */ a4(Input, { field: inner, value: item, bad: Boolean(problem), label: name, put: putItem, ...at }),
      after,
      /* @__PURE__ */ a4(Problem, { path: at.path, text: problem })
    ] }, i4);
  };
  return /* @__PURE__ */ a4("fieldset", { class: "group-field rows-field", children: [
    /* @__PURE__ */ a4("legend", { children: [
      field.name,
      " ",
      /* @__PURE__ */ a4(Type, { field })
    ] }),
    field.comment && /* @__PURE__ */ a4("small", { class: "comment", children: field.comment }),
    /* @__PURE__ */ a4(Problem, { path, text: problemOf(problems, path) }),
    value.map(row),
    !isFixed && /* @__PURE__ */ a4("button", { type: "button", class: "small", disabled: disabled || value.length >= MOST_ROWS2, onClick: add, children: [
      "+ ",
      field.name
    ] })
  ] });
}

// src/panels/goal_pane.tsx
var TABS = ["form", "yaml"];
var MOST_LINES2 = 40;
function GoalForm({ name, server }) {
  const [definition, setDefinition] = d2(null);
  const [failure2, setFailure] = d2(null);
  const [tab, setTab] = d2("form");
  const [state, setState] = d2({});
  const [yaml, setYaml] = d2("");
  const [problems, setProblems] = d2([]);
  const [, redraw] = d2(0);
  const [busy, setBusy] = d2(false);
  const box = T2(null);
  const type = server?.type ?? definition?.type;
  const why = refusal();
  const begin = (from) => {
    setState(toState(from.fields, from.values));
    setYaml(from.yaml);
    setProblems([]);
  };
  A2(() => {
    if (!server || definition?.type === type) return;
    setFailure(null);
    ask(`/api/action?name=${encoded(name)}`).then((found) => {
      if (isFailure(found)) {
        setFailure(found.text);
        return;
      }
      setDefinition(found);
      begin(found);
    });
  }, [name, type, !server]);
  const head2 = /* @__PURE__ */ a4($, { children: [
    /* @__PURE__ */ a4("header", { children: [
      /* @__PURE__ */ a4("h2", { children: [
        "/",
        name
      ] }),
      type && /* @__PURE__ */ a4("span", { class: "type", children: type })
    ] }),
    definition?.about && /* @__PURE__ */ a4("p", { class: "doc", children: definition.about }),
    !server && /* @__PURE__ */ a4("p", { class: "banner-line waiting", role: "status", children: [
      "No server of ",
      /* @__PURE__ */ a4("b", { children: [
        "/",
        name
      ] }),
      " on the network: it has left or died. The form stays; you can send it when the server is back."
    ] }),
    why && /* @__PURE__ */ a4("p", { class: "banner-line preempted", role: "note", id: "why", children: why })
  ] });
  if (failure2)
    return /* @__PURE__ */ a4($, { children: [
      head2,
      /* @__PURE__ */ a4("pre", { class: "error", role: "alert", children: failure2 })
    ] });
  if (!definition)
    return /* @__PURE__ */ a4($, { children: [
      head2,
      /* @__PURE__ */ a4("p", { class: "hint", children: server ? "Asking for its definition…" : "" })
    ] });
  const { fields: fields2 } = definition;
  const text2 = () => tab === "form" ? toYaml(fields2, state) : yaml;
  const refuse = (answer) => {
    setProblems(answer.problems.length ? answer.problems : [{ path: "", text: answer.text }]);
    requestAnimationFrame(() => focusIn(box.current, "[aria-invalid=true]"));
  };
  const turnTo = async (other) => {
    if (other === tab) return;
    if (!why && server) {
      const answer = await askAction({ command: "check", name, yaml: text2() });
      if (!answer.ok) {
        refuse(answer);
        return;
      }
      begin({ ...definition, ...answer });
    }
    setTab(other);
  };
  const send = async () => {
    if (why || !server || busy) return;
    setBusy(true);
    const answer = await askAction({ command: "send", name, yaml: text2() });
    setBusy(false);
    if (!answer.ok) refuse(answer);
    else {
      setProblems([]);
      store.view.notify(`goal sent to /${name}`);
    }
  };
  const onKeyDown = (e4) => {
    if (e4.key !== "Enter" || !(e4.ctrlKey || e4.metaKey)) return;
    e4.preventDefault();
    send();
  };
  const onTabKey = (e4) => {
    if (!["ArrowLeft", "ArrowRight"].includes(e4.key)) return;
    e4.preventDefault();
    e4.stopPropagation();
    turnTo(TABS[1 - TABS.indexOf(tab)]).then(() => focusIn(box.current, "[role=tab][aria-selected=true]"));
  };
  const tabButton = (one) => /* @__PURE__ */ a4(
    "button",
    {
      role: "tab",
      type: "button",
      id: `tab-${one}`,
      "aria-selected": tab === one,
      "aria-controls": "goal-text",
      tabindex: tab === one ? 0 : -1,
      onKeyDown: onTabKey,
      onClick: () => turnTo(one),
      children: one === "form" ? "Form" : "YAML"
    }
  );
  const listed2 = tab === "form" ? problemsWithoutField(problems, fields2, state) : problems;
  return /* @__PURE__ */ a4("div", { class: "goal-form", ref: box, onKeyDown, children: [
    head2,
    /* @__PURE__ */ a4("div", { class: "tabs", role: "tablist", "aria-label": "how to write the goal", children: [
      TABS.map(tabButton),
      /* @__PURE__ */ a4("span", { class: "spread" }),
      /* @__PURE__ */ a4("button", { type: "button", disabled: Boolean(why), onClick: () => begin(definition), children: "Defaults" })
    ] }),
    /* @__PURE__ */ a4(ProblemList, { problems: listed2 }),
    /* @__PURE__ */ a4("div", { id: "goal-text", role: "tabpanel", "aria-labelledby": `tab-${tab}`, children: tab === "form" ? /* @__PURE__ */ a4($, { children: [
      /* @__PURE__ */ a4(
        Fields,
        {
          fields: fields2,
          state,
          problems,
          disabled: Boolean(why),
          onChange: () => redraw((n3) => n3 + 1)
        }
      ),
      !fields2.length && /* @__PURE__ */ a4("p", { class: "hint", children: "This goal has no fields." })
    ] }) : /* @__PURE__ */ a4(YamlText, { yaml, invalid: problems.length > 0, readonly: Boolean(why), onChange: setYaml }) }),
    /* @__PURE__ */ a4("div", { class: "send-line", children: [
      /* @__PURE__ */ a4(
        "button",
        {
          type: "button",
          id: "send-goal",
          class: "primary",
          disabled: Boolean(why) || !server || busy,
          "aria-describedby": why ? "why" : void 0,
          onClick: send,
          children: busy ? "Sending…" : "Send goal"
        }
      ),
      !why && /* @__PURE__ */ a4("small", { class: "hint", children: "or Ctrl+Enter" })
    ] })
  ] });
}
var focusIn = (box, selector) => box?.querySelector(selector)?.focus();
var ProblemList = ({ problems }) => problems.length ? /* @__PURE__ */ a4("ul", { class: "error problem-list", role: "alert", children: problems.map((one) => /* @__PURE__ */ a4("li", { children: [
  one.path && /* @__PURE__ */ a4("code", { children: one.path }),
  " ",
  one.text
] })) }) : null;
function YamlText({
  yaml,
  invalid,
  readonly,
  onChange
}) {
  const rows = Math.min(MOST_LINES2, Math.max(10, yaml.split("\n").length + 1));
  return /* @__PURE__ */ a4(
    "textarea",
    {
      "aria-label": "the goal as YAML",
      "aria-invalid": invalid,
      spellcheck: false,
      wrap: "off",
      readonly,
      value: yaml,
      rows,
      onInput: (e4) => onChange(fieldValue(e4))
    }
  );
}
function refusal() {
  if (!store.data.settings.value.control)
    return /* @__PURE__ */ a4($, { children: [
      "This viewer sends no commands. To send goals, start it with ",
      /* @__PURE__ */ a4("code", { children: "smachpy view --control" }),
      " and open the address that it prints."
    ] });
  if (!hasToken())
    return /* @__PURE__ */ a4($, { children: [
      "The address of this page has no token. To send goals, open the address that ",
      /* @__PURE__ */ a4("code", { children: "smachpy" }),
      " printed."
    ] });
  return store.data.connection.value !== "live" ? "The viewer's server does not answer; nothing can be sent." : null;
}

// src/panels/goals.tsx
var RECENT_MS = 6e4;
var MOST3 = 6;
var MOST_ENDED = 3;
var MARKS = { success: "✓", failure: "✕", preempted: "■", other: "•" };
function Goals({ page: page2, data, now }) {
  const [all, setAll] = d2(false);
  const goals = Object.entries(data.goals).sort(([, a5], [, b3]) => (b3.ended ?? b3.since) - (a5.ended ?? a5.since));
  const running = goals.filter(([, goal]) => goal.ended == null).slice(0, MOST3);
  const ended = goals.filter(([, goal]) => goal.ended != null && (all || now - goal.ended / 1e6 < RECENT_MS));
  const shown = all ? ended : ended.slice(0, MOST_ENDED);
  const left = goals.filter(([, goal]) => goal.ended != null).length - shown.length;
  return /* @__PURE__ */ a4(Section, { title: "Goals", children: [
    !goals.length && /* @__PURE__ */ a4("p", { class: "hint", children: "none" }),
    running.map(([id, goal]) => /* @__PURE__ */ a4(Goal, { id, goal, now, page: page2 }, id)),
    shown.map(([id, goal]) => /* @__PURE__ */ a4(EndedGoal, { id, goal, page: page2 }, id)),
    left > 0 && /* @__PURE__ */ a4("button", { class: "small", onClick: () => setAll(true), children: [
      left,
      " earlier"
    ] })
  ] });
}
function EndedGoal({ id, goal, page: page2 }) {
  const [open, setOpen] = d2(false);
  const kind = outcomeClass(goal.status);
  const took = duration(((goal.ended ?? goal.since) - goal.since) / 1e9);
  const status = goal.status.toLowerCase();
  const onClick = (e4) => e4.target.closest(".link") || setOpen(!open);
  const title = [`${status}: ${goal.action}`, goal.text, id].filter(Boolean).join("\n");
  return /* @__PURE__ */ a4("div", { ...linked(goal, `ended-goal ${kind}`), children: [
    /* @__PURE__ */ a4("div", { class: "line", title, onClick, children: [
      /* @__PURE__ */ a4("button", { class: `ended ${kind}`, "aria-label": status, "aria-expanded": open, children: MARKS[kind] }),
      /* @__PURE__ */ a4(StateLink, { path: goal.path, page: page2 }),
      /* @__PURE__ */ a4("span", { class: "what", children: [purposeText(id, goal), goal.text || status].filter(Boolean).join(" ") }),
      /* @__PURE__ */ a4("span", { class: "times", children: took })
    ] }),
    open && /* @__PURE__ */ a4($, { children: [
      /* @__PURE__ */ a4("p", { class: "hint", children: [
        goal.action,
        ": ",
        status,
        (goal.attempt ?? 1) > 1 ? `, attempt ${goal.attempt}` : ""
      ] }),
      /* @__PURE__ */ a4("pre", { children: [
        "goal: ",
        pretty(goal.goal),
        "\n",
        "result: ",
        pretty(goal.result)
      ] })
    ] })
  ] });
}
function Goal({ id, goal, now, page: page2 }) {
  const waits = store.status.hasNoServer(goal);
  const kind = waits ? "waiting" : "active";
  const part = goal.progress?.fraction ?? null;
  const took = duration((now - goal.since / 1e6) / 1e3);
  return /* @__PURE__ */ a4("div", { ...linked(goal, `goal ${kind}`), title: id, children: [
    /* @__PURE__ */ a4("div", { class: "head", children: [
      /* @__PURE__ */ a4(StateLink, { path: goal.path, page: page2 }),
      /* @__PURE__ */ a4("span", { class: "action", children: [goal.action, purposeText(id, goal)].filter(Boolean).join(" ") }),
      /* @__PURE__ */ a4("span", { class: "times", children: [
        (goal.attempt ?? 1) > 1 ? `attempt ${goal.attempt} · ` : "",
        took
      ] })
    ] }),
    /* @__PURE__ */ a4(ProgressBar, { part, ended: false }),
    /* @__PURE__ */ a4("div", { class: "text", children: [
      /* @__PURE__ */ a4(Pill, { kind, children: waits ? "no server seen" : "active" }),
      " ",
      goal.text || progressText(goal.progress),
      part !== null && /* @__PURE__ */ a4("span", { class: "times", children: [
        Math.round(part * 100),
        " %"
      ] })
    ] }),
    /* @__PURE__ */ a4(Foldable, { label: "goal", value: goal.goal })
  ] });
}
var purposeText = (id, goal) => {
  const purpose = purposeOf(id, goal);
  return purpose && `→ ${purpose}`;
};
var linked = (goal, kind) => ({
  ...store.pointer.hoverHandlers(goal.path, goal.since / 1e6),
  class: `${kind} ${store.pointer.isLit(goal.path, goal.since / 1e6) ? "lit" : ""}`
});
var progressText = (progress) => {
  const distance = progress?.distance != null ? `${progress.distance.toFixed(2)} m left` : "";
  return [distance, progress?.text].filter(Boolean).join(" · ");
};
function ProgressBar({ part, ended }) {
  const percent2 = Math.round((part ?? (ended ? 1 : 0)) * 100);
  return /* @__PURE__ */ a4(
    "div",
    {
      class: `bar ${part === null && !ended ? "unknown" : ""}`,
      role: "progressbar",
      "aria-label": "progress",
      "aria-valuemin": 0,
      "aria-valuemax": 100,
      "aria-valuenow": part === null ? void 0 : percent2,
      children: /* @__PURE__ */ a4("i", { style: { width: `${percent2}%` } })
    }
  );
}
function Foldable({ label, value }) {
  const [open, setOpen] = d2(false);
  if (value == null) return null;
  const onToggle = (e4) => setOpen(e4.target.open);
  return /* @__PURE__ */ a4("details", { open, onToggle, children: [
    /* @__PURE__ */ a4("summary", { children: label }),
    open && /* @__PURE__ */ a4("pre", { children: pretty(value) })
  ] });
}

// src/panels/keys.tsx
var STEP = 80;
var PRESSED = "a[href], button, summary, tr[tabindex]";
var ON_OTHERS = ["a", "d", "h", "?", "Escape"];
var ARROWS = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1]
};
function jumpToChange(step) {
  const key = store.playback.followedKey.value ?? [...store.data.marks.keys].sort()[0];
  if (key !== void 0) store.playback.jump(`key ${key}`, step);
}
function togglePage(name) {
  if (store.view.pageShown.value !== name) showPage(name);
  else if (store.data.model.value || name !== "runs") showPage("machine");
}
function listenToKeys(page2) {
  const actions = {
    "/": () => document.getElementById("search")?.focus(),
    0: () => page2.layouts.refit(),
    f: () => store.playback.jump("kind failure", 1),
    F: () => store.playback.jump("kind failure", -1),
    p: () => store.playback.jump("kind preempt", 1),
    P: () => store.playback.jump("kind preempt", -1),
    g: () => store.playback.jump("kind goal", 1),
    G: () => store.playback.jump("kind goal", -1),
    k: () => jumpToChange(1),
    K: () => jumpToChange(-1),
    Home: () => store.playback.seek(store.data.run.first()),
    End: () => page2.timeline.live(),
    m: () => {
      store.view.part.value = "map";
      page2.map.canvas.focus();
    },
    r: () => store.playback.toggleLoop(),
    "[": () => store.playback.moveStretch("from"),
    "]": () => store.playback.moveStretch("to"),
    c: () => store.clock.choose(CLOCKS[(CLOCKS.indexOf(store.clock.chosen.value) + 1) % CLOCKS.length]),
    w: () => showWhy(),
    n: () => store.notes.begin(),
    t: () => {
      store.view.treeOpen.value = !store.view.treeOpen.value;
    },
    o: () => page2.layouts.setFollow(!store.view.follow.value),
    "+": () => page2.view.zoom(1.25),
    "=": () => page2.view.zoom(1.25),
    "-": () => page2.view.zoom(0.8),
    ",": () => store.playback.seekEvent(-1),
    ".": () => store.playback.seekEvent(1),
    l: () => page2.timeline.live(),
    i: () => page2.layouts.setImplicit(!store.view.implicit.value),
    h: () => isFile() || togglePage("runs"),
    a: () => isFile() || togglePage("actions"),
    d: () => page2.setTheme(isDark() ? "light" : "dark"),
    "?": () => {
      store.view.help.value = !store.view.help.value;
    },
    Enter: () => page2.layouts.toggle(store.view.selected.value),
    Escape: () => {
      if (confirmation.value) confirmation.value = null;
      else if (store.view.help.value) store.view.help.value = false;
      else if (store.notes.writtenAt.value !== null) store.notes.writtenAt.value = null;
      else if (store.view.tokenAsked.value) store.view.tokenAsked.value = false;
      else if (store.view.pageShown.value !== "machine") togglePage(store.view.pageShown.value);
      else if (store.view.treeOpen.value) store.view.treeOpen.value = false;
      else if (store.playback.stretch.value) store.playback.selectStretch(0);
      else page2.select(null);
    },
    " ": () => {
      const paused = control()?.paused;
      if (paused === void 0 || store.playback.cursor.value !== null) store.playback.togglePlaying();
      else command(paused ? "resume" : "pause");
    },
    s: () => control() && command("step")
  };
  document.addEventListener("click", (e4) => {
    const pressed = e4.target instanceof Element ? e4.target.closest("button") : null;
    if (e4.detail > 0 && pressed === document.activeElement) pressed?.blur();
  });
  document.addEventListener("keydown", (e4) => {
    const target = e4.target;
    if ((e4.ctrlKey || e4.metaKey) && e4.key.toLowerCase() === "k" && !document.querySelector("dialog[open]")) {
      store.view.paletteOpen.value = true;
      e4.preventDefault();
      return;
    }
    if (e4.ctrlKey || e4.metaKey || e4.altKey || store.view.paletteOpen.value) return;
    if (["INPUT", "SELECT", "TEXTAREA"].includes(target.tagName)) {
      if (e4.key === "Escape") target.blur();
      return;
    }
    if ((e4.key === "Enter" || e4.key === " ") && target.closest(PRESSED)) return;
    if (document.querySelector("dialog[open]") && e4.key !== "Escape" && e4.key !== "?") return;
    if (!store.view.shortcuts.value && e4.key !== "Escape") return;
    if (store.view.pageShown.value !== "machine" && !ON_OTHERS.includes(e4.key)) return;
    if (e4.key in ARROWS) {
      const [dx, dy] = ARROWS[e4.key];
      if (store.view.selected.value && !e4.shiftKey) page2.selectNeighbour(dx, dy);
      else page2.view.pan(-dx * STEP, -dy * STEP);
    } else if (/^[1-9]$/.test(e4.key)) page2.layouts.setDepth(Number(e4.key));
    else if (Object.hasOwn(actions, e4.key)) actions[e4.key]();
    else return;
    e4.preventDefault();
  });
}

// src/panels/actions.tsx
var CANCELLING = {
  WAITING_FOR_CANCEL_ACK: "asked to cancel",
  PREEMPTING: "stopping",
  RECALLING: "stopping"
};
var GOALS_MS = 2e3;
function ActionsButton({ id }) {
  if (isFile()) return null;
  const open = store.view.pageShown.value === "actions";
  const running = (store.data.actions.value?.goals ?? []).filter((goal) => goal.ended == null).length;
  return /* @__PURE__ */ a4(
    "button",
    {
      id,
      class: open ? "on" : "",
      "aria-pressed": open,
      title: "send goals to actions (a)",
      onClick: () => togglePage("actions"),
      children: [
        "Actions ",
        running > 0 && /* @__PURE__ */ a4("span", { class: "count-badge", children: running })
      ]
    }
  );
}
var ActionsPage = () => store.view.pageShown.value === "actions" ? /* @__PURE__ */ a4(OpenPage, {}) : null;
function OpenPage() {
  const actions = store.data.actions.value?.actions ?? [];
  const chosen2 = store.view.chosenAction.value ?? actions[0]?.name ?? null;
  const heading = T2(null);
  A2(() => heading.current?.focus(), []);
  const isAway = chosen2 !== null && !actions.some((one) => one.name === chosen2);
  const listed2 = isAway ? [...actions, { name: chosen2 }] : actions;
  const server = actions.find((one) => one.name === chosen2);
  return /* @__PURE__ */ a4("section", { class: "actions-page", "aria-labelledby": "actions-title", children: [
    /* @__PURE__ */ a4("nav", { class: "action-list", "aria-label": "actions on the network", children: [
      /* @__PURE__ */ a4("h2", { id: "actions-title", tabindex: -1, ref: heading, children: [
        "Actions ",
        /* @__PURE__ */ a4("span", { class: "number", children: actions.length })
      ] }),
      !actions.length && /* @__PURE__ */ a4("p", { class: "hint", children: "No action server on the network yet. This list shows each as soon as it runs." }),
      /* @__PURE__ */ a4("ul", { children: listed2.map((one) => /* @__PURE__ */ a4("li", { children: /* @__PURE__ */ a4(Choice, { one, on: one.name === chosen2 }) }, one.name)) })
    ] }),
    /* @__PURE__ */ a4("div", { class: "goal-pane", children: chosen2 !== null && /* @__PURE__ */ a4(GoalForm, { name: chosen2, server }, chosen2) }),
    /* @__PURE__ */ a4("aside", { class: "sent-goals", "aria-label": "goals", children: [
      server && /* @__PURE__ */ a4(ServerGoals, { name: chosen2 }, chosen2),
      /* @__PURE__ */ a4(SentGoals, {})
    ] })
  ] });
}
function Choice({ one, on: on2 }) {
  const more = (one.servers ?? 1) - 1;
  const rivals = more > 0 ? ` and ${more} more: several servers have this name` : "";
  const onClick = () => {
    store.view.chosenAction.value = one.name ?? null;
  };
  return /* @__PURE__ */ a4("button", { class: `action ${on2 ? "on" : ""}`, "aria-current": on2, onClick, children: [
    /* @__PURE__ */ a4("b", { children: [
      "/",
      one.name
    ] }),
    /* @__PURE__ */ a4("small", { children: one.type ?? "its server is gone" }),
    one.node && /* @__PURE__ */ a4("small", { children: [
      "node /",
      one.node,
      rivals
    ] })
  ] });
}
function ServerGoals({ name }) {
  const [goals, setGoals] = d2([]);
  const [problem, setProblem] = d2("");
  const own2 = new Set(store.data.actions.value?.goals.map((goal) => goal.id));
  A2(() => {
    let open = true;
    const read = async () => {
      const found = await ask(`/api/goals?name=${encoded(name)}`);
      if (!open) return;
      setGoals(isFailure(found) ? [] : found);
      setProblem(isFailure(found) ? found.text : "");
    };
    read();
    const timer = setInterval(() => document.hidden || read(), GOALS_MS);
    return () => {
      open = false;
      clearInterval(timer);
    };
  }, []);
  const others = goals.filter((goal) => !own2.has(goal.id));
  const askFor = (goal) => askFirst({
    title: `Cancel the goal of ${senderText(goal)} to /${name}?`,
    yes: "Cancel the goal",
    lines: () => [
      goal.mission ? "Its mission goes on with the transition for a cancelled goal." : "",
      goal.gone ? "Its program is gone: nobody else can cancel it." : "Its program is told, and may send another."
    ],
    situation: () => JSON.stringify([store.view.pageShown.value, store.data.connection.value]),
    give: async () => {
      const answer = await askAction({ command: "cancel", name, goal: goal.id });
      store.view.notify(
        answer.ok ? `goal ${goal.id}: asked to cancel` : answer.text ?? "refused",
        answer.ok ? "info" : "error"
      );
    }
  });
  if (!others.length && !problem) return null;
  return /* @__PURE__ */ a4("section", { "aria-label": `goals of others to /${name}`, children: [
    /* @__PURE__ */ a4("h2", { children: [
      "Goals of others to /",
      name,
      " ",
      /* @__PURE__ */ a4("span", { class: "number", children: others.length || "" })
    ] }),
    problem && /* @__PURE__ */ a4("p", { class: "hint", children: problem }),
    others.map((goal) => /* @__PURE__ */ a4("article", { class: `goal sent ${goal.gone ? "waiting" : "active"}`, children: [
      /* @__PURE__ */ a4("div", { class: "head", children: [
        /* @__PURE__ */ a4("b", { children: senderText(goal) }),
        /* @__PURE__ */ a4("span", { class: "times", children: duration(Math.max(0, Date.now() - goal.stamp / 1e6) / 1e3) })
      ] }),
      /* @__PURE__ */ a4("div", { class: "text", children: [
        /* @__PURE__ */ a4("span", { class: `pill-text ${goal.gone ? "waiting" : "active"}`, children: goal.gone ? "its client is gone" : goal.status.toLowerCase() }),
        " ",
        shorten(goal.text, 200)
      ] }),
      hasToken() && /* @__PURE__ */ a4("button", { class: "warn", onClick: () => askFor(goal), children: "Cancel" }),
      /* @__PURE__ */ a4("small", { class: "id", title: goal.id, children: goal.id })
    ] }, goal.id))
  ] });
}
var senderText = (goal) => shorten(goal.mission || (goal.sender ? `node /${goal.sender}` : "an unknown client"), 80);
function SentGoals() {
  const goals = store.data.actions.value?.goals ?? [];
  store.playback.watch();
  return /* @__PURE__ */ a4("section", { "aria-label": "goals sent from here", children: [
    /* @__PURE__ */ a4("h2", { children: [
      "Goals sent from here ",
      /* @__PURE__ */ a4("span", { class: "number", children: goals.length || "" })
    ] }),
    !goals.length && /* @__PURE__ */ a4("p", { class: "hint", children: "none yet" }),
    goals.map((goal) => /* @__PURE__ */ a4(Goal2, { goal }, goal.id))
  ] });
}
function statusOf2(goal) {
  if (goal.ended != null) return { kind: outcomeClass(goal.status), text: goal.status.toLowerCase() };
  if (goal.state in CANCELLING) return { kind: "preempted", text: CANCELLING[goal.state] };
  if (goal.cancelled) return { kind: "preempted", text: "asked to cancel" };
  if (goal.state === "ACTIVE") return { kind: "active", text: "active" };
  if (goal.state === "WAITING_FOR_GOAL_ACK") return { kind: "waiting", text: "sent" };
  return { kind: "waiting", text: goal.state.toLowerCase().replaceAll("_", " ") };
}
function Goal2({ goal }) {
  const ended = goal.ended != null;
  const { kind, text: text2 } = statusOf2(goal);
  const part = goal.status === "SUCCEEDED" ? 1 : goal.fraction;
  const until = goal.ended != null ? goal.ended / 1e6 : Date.now();
  const took = duration(Math.max(0, until - goal.sent / 1e6) / 1e3);
  const distance = goal.distance != null && !ended ? `${goal.distance.toFixed(2)} m left` : "";
  const cancel = async () => {
    const answer = await askAction({ command: "cancel", goal: goal.id });
    if (!answer.ok) store.view.notify(answer.text ?? "refused", "error");
  };
  return /* @__PURE__ */ a4("article", { class: `goal sent ${kind}`, "aria-label": `goal to /${goal.action}, ${text2}`, children: [
    /* @__PURE__ */ a4("div", { class: "head", children: [
      /* @__PURE__ */ a4("b", { children: [
        "/",
        goal.action
      ] }),
      /* @__PURE__ */ a4("span", { class: "times", children: took })
    ] }),
    /* @__PURE__ */ a4(ProgressBar, { part, ended }),
    /* @__PURE__ */ a4("div", { class: "text", children: [
      /* @__PURE__ */ a4("span", { class: `pill-text ${kind}`, role: "status", children: text2 }),
      " ",
      goal.status === "LOST" && "The server of this goal is gone; how the goal ended is not known. ",
      [goal.text, distance].filter(Boolean).join(" · "),
      part !== null && !ended && /* @__PURE__ */ a4("span", { class: "times", children: [
        Math.round(part * 100),
        " %"
      ] })
    ] }),
    !ended && hasToken() && /* @__PURE__ */ a4("button", { class: "warn", onClick: cancel, disabled: goal.cancelled, children: "Cancel" }),
    goal.result != null && /* @__PURE__ */ a4("details", { open: true, children: [
      /* @__PURE__ */ a4("summary", { children: "result" }),
      /* @__PURE__ */ a4("pre", { children: goal.result === "{}" ? "no fields" : goal.result })
    ] }),
    goal.feedback != null && /* @__PURE__ */ a4("details", { open: !ended, children: [
      /* @__PURE__ */ a4("summary", { children: [
        "feedback, the newest of ",
        goal.feedback_count
      ] }),
      /* @__PURE__ */ a4("pre", { children: goal.feedback })
    ] }),
    /* @__PURE__ */ a4("small", { class: "id", title: goal.id, children: goal.id })
  ] });
}

// src/panels/controls.tsx
var LONG = 18;
function Command({
  does,
  onClick,
  children,
  title,
  why = null,
  class: name = "",
  ...more
}) {
  const reason = store.status.whyDisarmed.value ?? why;
  const mine = sent.value?.key === does ? sent.value : null;
  const state = mine && (mine.failure === null ? "sent" : "failed");
  const refuse = () => store.view.notify(reason ?? "", "error");
  return /* @__PURE__ */ a4(
    "button",
    {
      ...more,
      class: `${name} ${state ?? ""}`,
      title: mine?.failure ?? reason ?? title,
      "aria-disabled": reason !== null,
      "aria-busy": state === "sent",
      onClick: reason === null ? onClick : refuse,
      children
    }
  );
}
function OperatorBar() {
  store.playback.watch();
  const facts = control();
  if (!facts || store.view.pageShown.value !== "machine") return null;
  const { paused } = facts;
  if (store.data.run.now.ended != null && !paused) return null;
  const target = targetText();
  const isLong = target.length > LONG;
  return /* @__PURE__ */ a4("div", { class: "operator", role: "toolbar", "aria-label": `commands to ${target}`, children: [
    /* @__PURE__ */ a4(
      Command,
      {
        id: "pause",
        does: keyOf(paused ? "resume" : "pause"),
        title: paused ? "continue (Space)" : "pause before the next state (Space)",
        onClick: () => command(paused ? "resume" : "pause"),
        children: paused ? "Resume" : "Pause"
      }
    ),
    /* @__PURE__ */ a4(
      Command,
      {
        id: "pause-now",
        does: keyOf("pause now"),
        why: paused ? "It is paused" : null,
        title: "preempt the running states instead of waiting for their ends",
        onClick: () => askForPause(target),
        children: "Pause now"
      }
    ),
    /* @__PURE__ */ a4(
      Command,
      {
        id: "step",
        does: keyOf("step"),
        title: "run one state, then pause again (s)",
        why: paused ? null : "Pause first: a step runs one state of a paused mission",
        onClick: () => command("step"),
        children: "Step"
      }
    ),
    /* @__PURE__ */ a4(
      Command,
      {
        id: "preempt",
        class: isLong ? "warn long" : "warn",
        does: keyOf("preempt", store.data.model.value?.root.path),
        title: `Preempt ${target}`,
        onClick: () => askForPreempt(target),
        children: /* @__PURE__ */ a4("span", { children: [
          "Preempt ",
          shorten(target, 60)
        ] })
      }
    )
  ] });
}
function askForPause(target) {
  const path = store.data.model.value?.root.path ?? "";
  const machine = store.data.facts.value?.name;
  askFirst({
    title: `Pause ${target} now?`,
    yes: "Pause now",
    lines: () => [...endsText(path), "These states are preempted, and begin again on Resume."],
    situation: () => situationOf(control()?.paused),
    give: () => command("pause", { running: "cancel" }, machine)
  });
}
function askForPreempt(target) {
  const path = store.data.model.value?.root.path ?? "";
  const machine = store.data.facts.value?.name;
  askFirst({
    title: `Preempt ${target}?`,
    yes: "Preempt",
    lines: () => [...endsText(path), "The mission ends with an outcome for preemption; it is not resumed."],
    situation: () => situationOf(),
    give: () => command("preempt", { path }, machine)
  });
}
function ConfirmationSheet() {
  store.playback.watch();
  const box = T2(null);
  const before = T2(null);
  const given = confirmation.value;
  const asked2 = given && confirmationNow();
  A2(() => {
    if (!asked2) return;
    before.current = document.activeElement;
    box.current?.querySelector("button")?.focus();
    return () => {
      if (before.current instanceof HTMLElement) before.current.focus();
    };
  }, [asked2]);
  if (!asked2) return null;
  const close2 = () => {
    confirmation.value = null;
  };
  const give = () => {
    if (confirmationNow() !== asked2) return;
    close2();
    asked2.give();
  };
  return /* @__PURE__ */ a4(
    "section",
    {
      class: "confirm",
      role: "alertdialog",
      "aria-labelledby": "confirm-title",
      "aria-describedby": "confirm-text",
      ref: box,
      children: [
        /* @__PURE__ */ a4("h2", { id: "confirm-title", children: asked2.title }),
        /* @__PURE__ */ a4("div", { id: "confirm-text", children: asked2.lines().map((line) => /* @__PURE__ */ a4("p", { children: line })) }),
        /* @__PURE__ */ a4("p", { class: "answers", children: [
          /* @__PURE__ */ a4("button", { class: "answer", onClick: close2, children: "No" }),
          /* @__PURE__ */ a4("button", { class: "answer warn", onClick: give, children: asked2.yes })
        ] })
      ]
    }
  );
}
function OutcomeBreakpoint({ node, outcome }) {
  const breakpoints = control()?.breakpoints;
  if (!breakpoints || !node.parent) return null;
  const on2 = breakpoints.some(([path, after]) => path === node.path && after === outcome);
  return /* @__PURE__ */ a4(
    Command,
    {
      class: `stop-after ${on2 ? "on" : ""}`,
      "aria-pressed": on2,
      does: keyOf(on2 ? "unbreak" : "break", `${node.path} after ${outcome}`),
      "aria-label": `breakpoint after ${outcome}`,
      title: `${on2 ? "do not pause" : "pause"} after ${outcome}`,
      onClick: () => command(on2 ? "unbreak" : "break", { path: node.path, outcome }),
      children: "●"
    }
  );
}
function StateControls({ node, state }) {
  const [outcome, setOutcome] = d2("");
  const breakpoints = control()?.breakpoints;
  if (!breakpoints) return null;
  const { path, parent } = node;
  const [machine, target] = [store.data.facts.value?.name, targetText()];
  const ask2 = (name, title, yes, within3, end, more = { path }) => askFirst({
    title,
    yes,
    lines: () => [...endsText(within3), end],
    situation: () => situationAt(path, within3),
    give: () => command(name, { ...more }, machine)
  });
  if (isPartOfNet(node)) {
    if (node.kind !== "transition" || !parent) return null;
    const fire = () => ask2("fire", `Fire ${node.name} of ${target}?`, "Fire", parent.path, "Its guard is not asked.", {
      path: parent.path,
      transition: node.label
    });
    return /* @__PURE__ */ a4("div", { class: "actions", children: /* @__PURE__ */ a4(Command, { does: keyOf("fire", parent.path), onClick: fire, children: "Fire" }) });
  }
  const active = state?.since != null;
  const stops = breakpoints.some(([at, after]) => at === path && after === null);
  const chosen2 = node.outcomes.includes(outcome) ? outcome : node.outcomes[0];
  const canJump = parent && parent.kind !== "concurrence";
  const jump = () => parent && ask2("jump", `Continue ${target} at ${node.name}?`, "Jump", parent.path, `They end, and ${node.name} begins.`);
  const preempt = () => ask2("preempt", `Preempt ${node.name} of ${target}?`, "Preempt", path, "The mission goes on with its transition.");
  const force = () => ask2("force", `End ${node.name} of ${target} with ${chosen2}?`, `End with ${chosen2}`, path, goesTo(node, chosen2), {
    path,
    outcome: chosen2
  });
  return /* @__PURE__ */ a4("div", { class: "actions", children: [
    /* @__PURE__ */ a4(
      Command,
      {
        class: stops ? "on" : "",
        "aria-pressed": stops,
        does: keyOf(stops ? "unbreak" : "break", path),
        onClick: () => command(stops ? "unbreak" : "break", { path }),
        children: stops ? "Remove breakpoint" : "Breakpoint"
      }
    ),
    canJump && /* @__PURE__ */ a4($, { children: [
      /* @__PURE__ */ a4(Command, { does: keyOf("jump", path), onClick: jump, children: "Jump here" }),
      /* @__PURE__ */ a4(
        Command,
        {
          does: keyOf("initial", parent.path),
          title: "the next run of the container starts with this state",
          onClick: () => command("initial", { path: parent.path, states: [node.label] }),
          children: "Start here"
        }
      )
    ] }),
    active && parent && /* @__PURE__ */ a4(Command, { class: "warn", does: keyOf("preempt", path), onClick: preempt, children: "Preempt" }),
    active && parent && /* @__PURE__ */ a4("span", { class: "force", children: [
      /* @__PURE__ */ a4("select", { "aria-label": "outcome", value: chosen2, onChange: (e4) => setOutcome(fieldValue(e4)), children: node.outcomes.map((one) => /* @__PURE__ */ a4("option", { value: one, children: one })) }),
      /* @__PURE__ */ a4(Command, { does: keyOf("force", path), onClick: force, children: "Force outcome" })
    ] })
  ] });
}
function goesTo(node, outcome) {
  const target = store.data.model.value?.linkOf(node, outcome)?.target;
  return target ? `The mission goes on with ${shorten(target)}.` : "Its container decides how the mission goes on.";
}

// src/panels/docks.tsx
var STEP2 = 24;
var TITLES = {
  tree: "States",
  map: "Map",
  details: "Details",
  time: "Timeline",
  plots: "Plots"
};
var KEYS = {
  ArrowLeft: "left",
  ArrowRight: "right",
  ArrowDown: "bottom",
  Delete: null
};
var dropped = y3(null);
function Dock({ name, panels: panels2 }) {
  const all = store.panels.arrangementShown.value;
  const docked2 = all[name].filter((one) => store.panels.panelsThere.value.has(one.name));
  const at = dropped.value?.dock === name ? dropped.value.index : null;
  const width = name === "bottom" ? {} : { "--width": `${all.widths[name]}px` };
  const isEmpty = !docked2.length && at === null;
  return /* @__PURE__ */ a4("div", { class: `dock ${name} ${isEmpty ? "empty-dock" : ""} ${at === null ? "" : "target"}`, style: width, children: [
    name !== "bottom" && docked2.length > 0 && /* @__PURE__ */ a4(WidthHandle, { dock: name }),
    docked2.map(({ name: panel, size }, i4) => {
      const classes = ["panel", `panel-${panel}`, size !== null && "sized", at === i4 && "before"];
      const isSizable = name === "bottom" || i4 < docked2.length - 1;
      return /* @__PURE__ */ a4(
        "div",
        {
          "data-panel": panel,
          class: classes.filter(Boolean).join(" "),
          style: size === null ? {} : { "--size": `${size}px` },
          children: [
            panels2[panel](),
            /* @__PURE__ */ a4(Grip, { name: panel }),
            isSizable && /* @__PURE__ */ a4(HeightHandle, { dock: name, name: panel })
          ]
        },
        panel
      );
    })
  ] });
}
function Grip({ name }) {
  const put2 = (dock, index = Infinity) => store.panels.arrange(moved(store.panels.arrangementShown.value, name, dock, index));
  const onPointerDown = (e4) => {
    if (e4.button !== 0) return;
    e4.preventDefault();
    const move = (m5) => {
      const page2 = { w: innerWidth, h: innerHeight };
      dropped.value = dropAt({ x: m5.clientX, y: m5.clientY }, boxesOfDocks(), page2);
    };
    drag(move, (m5) => {
      const place = dropped.value;
      dropped.value = null;
      if (!place || m5.type === "pointercancel") return;
      const behind = docked(place.dock)[place.index];
      const index = behind ? placeOf(store.panels.arrangementShown.value, behind)?.index : void 0;
      put2(place.dock, index);
    });
  };
  const onKeyDown = (e4) => {
    const all = store.panels.arrangementShown.value;
    const place = placeOf(all, name);
    if (e4.key === "ArrowUp" && place) put2(place.dock, Math.max(0, place.index - 1));
    else if (e4.key === "ArrowDown" && place && place.index < all[place.dock].length - 1)
      put2(place.dock, place.index + 2);
    else if (e4.key in KEYS) put2(KEYS[e4.key]);
    else return;
    e4.preventDefault();
    e4.stopPropagation();
    requestAnimationFrame(() => gripOf(name)?.focus());
  };
  const title = `${TITLES[name]}: drag it to another side; arrow keys move it, Delete hides it, View shows it again`;
  return /* @__PURE__ */ a4("button", { class: "grip", "aria-label": title, title, onPointerDown, onKeyDown, children: "⋮" });
}
var gripOf = (name) => document.querySelector(`[data-panel=${name}] > .grip`);
var docked = (name) => store.panels.arrangementShown.value[name].map((one) => one.name).filter((one) => store.panels.panelsThere.value.has(one));
function boxesOfDocks() {
  const boxOf2 = (element) => {
    const { x: x3, y: y5, width: w5, height: h5 } = element.getBoundingClientRect();
    return { x: x3, y: y5, w: w5, h: h5 };
  };
  return DOCKS.flatMap((dock) => {
    const element = document.querySelector(`.dock.${dock}`);
    if (!element) return [];
    return [{ dock, box: boxOf2(element), panels: [...element.querySelectorAll(":scope > .panel")].map(boxOf2) }];
  });
}
function Handle({
  label,
  vertical,
  size,
  resize: resize2,
  sign: sign2
}) {
  const [shown, setShown] = d2(0);
  A2(() => setShown(size()));
  const onPointerDown = (e4) => {
    if (e4.button !== 0) return;
    e4.preventDefault();
    const before = size();
    drag((m5) => resize2(before + sign2 * (vertical ? m5.clientX - e4.clientX : m5.clientY - e4.clientY)));
  };
  const onKeyDown = (e4) => {
    const [less, more] = vertical ? ["ArrowLeft", "ArrowRight"] : ["ArrowUp", "ArrowDown"];
    const step = { [less]: -1, [more]: 1 }[e4.key];
    if (!step) return;
    resize2(size() + sign2 * step * STEP2);
    e4.preventDefault();
    e4.stopPropagation();
  };
  return /* @__PURE__ */ a4(
    "div",
    {
      class: `handle ${vertical ? "upright" : "level"}`,
      role: "separator",
      tabindex: 0,
      "aria-label": label,
      "aria-orientation": vertical ? "vertical" : "horizontal",
      "aria-valuenow": Math.round(shown),
      "aria-valuemin": 56,
      "aria-valuemax": 2e3,
      "aria-valuetext": `${Math.round(shown)} pixels`,
      onPointerDown,
      onKeyDown
    }
  );
}
var WidthHandle = ({ dock }) => /* @__PURE__ */ a4(
  Handle,
  {
    label: `width of the ${dock} side`,
    vertical: true,
    sign: dock === "left" ? 1 : -1,
    size: () => store.panels.arrangementShown.value.widths[dock],
    resize: (width) => store.panels.arrange(widened(store.panels.arrangementShown.value, dock, width))
  }
);
var HeightHandle = ({ dock, name }) => /* @__PURE__ */ a4(
  Handle,
  {
    label: `height of ${TITLES[name]}`,
    vertical: false,
    sign: dock === "bottom" ? -1 : 1,
    size: () => document.querySelector(`[data-panel=${name}]`)?.clientHeight ?? 0,
    resize: (size) => store.panels.arrange(resized(store.panels.arrangementShown.value, name, size))
  }
);
function PanelLines() {
  const all = store.panels.arrangementShown.value;
  const choose2 = (name) => (e4) => {
    const dock = DOCKS.find((one) => one === fieldValue(e4)) ?? null;
    store.panels.arrange(moved(all, name, dock));
  };
  const select = ([name, title]) => {
    const panel = name;
    return /* @__PURE__ */ a4("label", { class: "line", children: [
      /* @__PURE__ */ a4("span", { children: title }),
      /* @__PURE__ */ a4("select", { value: placeOf(all, panel)?.dock ?? "hidden", onChange: choose2(panel), children: [...DOCKS, "hidden"].map((one) => /* @__PURE__ */ a4("option", { value: one, children: one })) })
    ] });
  };
  return /* @__PURE__ */ a4("details", { class: "panel-lines", children: [
    /* @__PURE__ */ a4("summary", { children: "Panels" }),
    Object.entries(TITLES).map(select),
    /* @__PURE__ */ a4("div", { class: "line", children: [
      /* @__PURE__ */ a4("span", { children: "As they were" }),
      /* @__PURE__ */ a4("button", { onClick: () => store.panels.arrange(null), children: "reset" })
    ] })
  ] });
}
function Parts() {
  const part = ([name, title, path]) => {
    const isShown2 = store.view.part.value === name;
    const onClick = () => {
      store.view.part.value = name;
    };
    return /* @__PURE__ */ a4("button", { class: isShown2 ? "on" : "", "aria-current": isShown2 ? "page" : void 0, onClick, children: [
      /* @__PURE__ */ a4("svg", { viewBox: "0 0 24 24", "aria-hidden": "true", children: /* @__PURE__ */ a4("path", { d: path }) }),
      title
    ] });
  };
  return /* @__PURE__ */ a4("nav", { class: "parts", "aria-label": "parts of the page", children: PARTS.filter(([name]) => name !== "map" || store.panels.hasMap.value).map(part) });
}
var PARTS = [
  ["machine", "Machine", "M3 4h7v6H3ZM14 14h7v6h-7ZM10 7h7v7"],
  ["map", "Map", "M3 6l6-2 6 2 6-2v14l-6 2-6-2-6 2ZM9 4v14M15 6v14"],
  ["time", "Time", "M12 3a9 9 0 1 0 .01 0ZM12 7v5l3 2"],
  ["log", "Log", "M8 6h13M8 12h13M8 18h13M3 6h1M3 12h1M3 18h1"]
];

// src/core/fleet.ts
var nameOfRow = (row) => row.robots.length === 1 ? row.robots[0] : row.name ?? row.machine;
function countText({ rows, skip, total: total2 }) {
  const which = rows.length < total2 ? `${skip + 1} to ${skip + rows.length} of ` : "";
  return `${which}${total2.toLocaleString("en")} live ${total2 === 1 ? "run" : "runs"}`;
}
function lanesOf2(rows, now) {
  const begins = rows.flatMap((row) => row.began === null ? [] : [row.began / 1e9]);
  const first = begins.length ? Math.min(...begins) : now / 1e3;
  const ends = rows.flatMap((row) => row.last === null ? [] : [row.last / 1e9]);
  const seconds = Math.max(1, Math.max(now / 1e3, ...ends) - first);
  return {
    seconds,
    lanes: rows.map((row) => ({
      id: row.id,
      name: nameOfRow(row),
      bars: row.strip.map(([, name, from, to, kind]) => {
        const after = (row.began ?? 0) / 1e9 - first;
        return { name, kind, from: after + from, to: to === null ? seconds : after + to };
      })
    }))
  };
}
function sceneOf(rows) {
  const scene = new Scene();
  let now = 0;
  for (const row of rows) {
    const called2 = row.name ?? row.machine;
    scene.addEvents(
      row.events.map(
        (e4) => "action" in e4 && /^\/?[^/]*$/.test(e4.action) ? { ...e4, action: `${called2}/${e4.action}` } : e4
      )
    );
    scene.addObserved(row.observed.map((one) => one.robot || one.what === "map" ? one : { ...one, robot: called2 }));
    for (const { stamp_ns } of [...row.events, ...row.observed]) now = Math.max(now, stamp_ns / 1e6);
  }
  return { scene, now };
}

// src/core/run_requests.ts
var REFRESH_MS = 2e3;
var refreshed = -REFRESH_MS;
var refreshDue = 0;
function refreshRuns() {
  if (refreshDue) return;
  refreshDue = setTimeout(
    async () => {
      const answer = await ask("/api/runs");
      refreshed = performance.now();
      refreshDue = 0;
      r3(() => {
        store.data.runsProblem.value = isFailure(answer) ? answer.text : "";
        if (!isFailure(answer)) store.data.runs.value = answer;
        store.data.runsKnown.value = true;
      });
    },
    Math.max(0, refreshed + REFRESH_MS - performance.now())
  );
}
async function askFleet(skip) {
  const answer = await ask(`/api/fleet?skip=${skip}`);
  return isFailure(answer) ? null : answer;
}
async function askSimulation(data) {
  const answer = await post("/api/simulate", data);
  await refreshSimulations();
  return answer;
}
async function refreshSimulations() {
  const answer = await ask("/api/simulations");
  if (isFailure(answer)) return;
  store.data.simulations.value = answer;
  store.data.simulationsKnown.value = true;
}
async function commandMission({ journal, id }, what) {
  const answer = await post("/api/mission", { journal, id, command: what });
  if (answer.ok) store.view.notify(`${id}: ${answer.text}`);
  else if (!answer.wants_token) store.view.notify(answer.text, "error");
  refreshRuns();
}
async function openRun(id) {
  const answer = await ask(`/api/open?run=${encoded(id)}`);
  if (!answer.ok) {
    store.view.notify(`Run: ${answer.text}`, "error");
    return;
  }
  choose(answer.name);
}

// src/panels/fleet.tsx
var REFRESH_MS2 = 1e3;
var GAP2 = 8;
var MOST_COLUMNS3 = 4;
var CARD2 = { width: 200 + GAP2, height: 88 + GAP2 };
var FleetPage = () => store.view.pageShown.value === "fleet" ? /* @__PURE__ */ a4(OpenFleet, {}) : null;
function OpenFleet() {
  const [skip, setSkip] = d2(0);
  const [found, setFound] = d2(null);
  const [width, setWidth] = d2(0);
  const heading = T2(null);
  const box = T2(null);
  A2(() => heading.current?.focus(), []);
  A2(() => {
    const seen2 = new ResizeObserver(() => setWidth(box.current?.clientWidth ?? 0));
    if (box.current) seen2.observe(box.current);
    return () => seen2.disconnect();
  }, []);
  A2(() => {
    let open = true;
    const read = async () => {
      const answer = await askFleet(skip);
      if (answer && open) setFound(answer);
    };
    read();
    const timer = setInterval(read, REFRESH_MS2);
    return () => {
      open = false;
      clearInterval(timer);
    };
  }, [skip]);
  const { rows, total: total2, skip: before } = found ?? { rows: [], total: 0, skip: 0 };
  const { scene, now } = sceneOf(rows);
  const { seconds, lanes } = lanesOf2(rows, now);
  const columns = Math.min(MOST_COLUMNS3, Math.max(1, Math.floor((width + GAP2) / CARD2.width)));
  const line = Math.floor(before / columns);
  const onScroll = (e4) => {
    const above = Math.floor(e4.target.scrollTop / CARD2.height) - 1;
    setSkip(Math.max(0, above * columns));
  };
  return /* @__PURE__ */ a4("section", { class: "fleet", "aria-labelledby": "fleet-title", children: [
    /* @__PURE__ */ a4("header", { children: [
      /* @__PURE__ */ a4("h2", { id: "fleet-title", tabindex: -1, ref: heading, children: "Fleet" }),
      /* @__PURE__ */ a4("span", { class: "hint", children: found ? countText(found) : "reading the runs…" }),
      /* @__PURE__ */ a4("span", { class: "spread" }),
      /* @__PURE__ */ a4("button", { onClick: () => showPage("runs"), children: "Close" })
    ] }),
    found && !total2 && /* @__PURE__ */ a4("p", { class: "empty-list", children: "No mission runs now. Each one that begins gets a card here." }),
    /* @__PURE__ */ a4("div", { class: found && scene.isEmpty ? "fleet-top without-map" : "fleet-top", children: [
      /* @__PURE__ */ a4("div", { class: "cards", ref: box, onScroll, children: /* @__PURE__ */ a4("div", { style: { height: `${Math.ceil(total2 / columns) * CARD2.height}px` }, children: /* @__PURE__ */ a4("div", { class: "in-view", style: { transform: `translateY(${line * CARD2.height}px)`, "--columns": columns }, children: rows.map((row) => /* @__PURE__ */ a4("button", { onClick: () => openRun(row.id), children: [
        /* @__PURE__ */ a4("b", { children: shorten(nameOfRow(row), 26) }),
        /* @__PURE__ */ a4("span", { class: `pill-text ${row.asks ? "waiting" : "active"}`, children: row.asks ? "? asks you" : `● ${shorten(row.strip.findLast((one) => one[3] === null)?.[1] ?? "running", 20)}` }),
        /* @__PURE__ */ a4("small", { title: row.reason, children: [
          shorten(row.machine, 20),
          ": ",
          shorten(row.reason, 60)
        ] })
      ] }, row.id)) }) }) }),
      !scene.isEmpty && /* @__PURE__ */ a4("div", { class: "fleet-map", children: /* @__PURE__ */ a4(FleetMap, { scene, now }) })
    ] }),
    /* @__PURE__ */ a4("div", { class: "lanes", role: "list", "aria-label": `the last ${duration(seconds)}`, children: lanes.map((lane) => /* @__PURE__ */ a4($, { children: [
      /* @__PURE__ */ a4("span", { title: lane.name, children: shorten(lane.name, 24) }),
      /* @__PURE__ */ a4(Lane, { lane, seconds })
    ] })) })
  ] });
}
function FleetMap(props) {
  const canvas2 = T2(null);
  const view2 = T2(null);
  const dark = isDark();
  A2(() => {
    if (canvas2.current && !view2.current) view2.current = new MapView(canvas2.current);
    if (!view2.current) return;
    view2.current.given = props;
    view2.current.draw();
  });
  A2(() => {
    view2.current?.restyle();
    view2.current?.draw();
  }, [dark]);
  return /* @__PURE__ */ a4("canvas", { ref: canvas2, tabindex: 0, role: "img" });
}
function Lane({ lane, seconds }) {
  const percent2 = (s4) => `${100 * s4 / seconds}%`;
  return /* @__PURE__ */ a4(
    "svg",
    {
      class: "run-strip",
      height: "20",
      role: "listitem",
      "aria-label": `${lane.name}: ${lane.bars.map((bar) => bar.name).join(", ")}`,
      children: lane.bars.map(({ name, kind, from, to }) => /* @__PURE__ */ a4(
        "rect",
        {
          class: kind,
          x: percent2(from),
          y: "1",
          height: "18",
          rx: "3",
          width: percent2(Math.max(to - from, 4e-3 * seconds)),
          children: /* @__PURE__ */ a4("title", { children: [
            name,
            ": ",
            duration(to - from)
          ] })
        }
      ))
    }
  );
}

// src/core/run_list.ts
var SHOWN = [
  "all",
  "live",
  "asking",
  "pinned",
  "durable",
  "interrupted",
  "queued",
  "success",
  "failure",
  "preempted",
  "other",
  "cut"
];
var SHOWN_NAMES = {
  all: "All runs",
  live: "Live",
  asking: "Asking a person",
  pinned: "Pinned",
  durable: "Durable",
  interrupted: "interrupted",
  queued: "queued",
  success: "succeeded",
  failure: "failed",
  preempted: "preempted",
  other: "other",
  cut: "without an end"
};
function standing(row) {
  const status = row.mission?.status ?? "";
  if (row.live || status === "running" && row.outcome === null) return "live";
  if (status === "interrupted" || status === "queued") return status;
  return row.outcome === null ? "cut" : outcomeClass(row.outcome);
}
var pinOf = (row) => row.run || (row.stamp === null ? row.id : `${row.machine} ${row.stamp}`);
function isShown(row, show2, pins2) {
  if (show2 === "all") return true;
  if (show2 === "pinned") return pins2.has(pinOf(row));
  if (show2 === "durable") return row.run !== "" || row.mission !== null;
  if (show2 === "asking") return row.asks;
  return standing(row) === show2;
}
function hasText(row, text2) {
  const all = [row.machine, ...row.robots, row.reason, row.outcome ?? "", ...row.strip.map((piece) => piece[1])];
  const inside2 = all.join(" ").toLowerCase();
  return text2.toLowerCase().split(/\s+/).every((word) => inside2.includes(word));
}
function chosen(rows, { show: show2, machine, robot, text: text2 }, pins2) {
  const found = rows.filter(
    (row) => isShown(row, show2, pins2) && (machine === null || row.machine === machine) && (robot === null || row.robots.includes(robot)) && hasText(row, text2)
  );
  const rank = (row) => row.live ? 0 : pins2.has(pinOf(row)) ? 1 : 2;
  return found.map((row, i4) => ({ row, i: i4 })).sort((a5, b3) => rank(a5.row) - rank(b3.row) || a5.i - b3.i).map(({ row }) => row);
}
var countsOf = (rows, pins2) => new Map(SHOWN.map((show2) => [show2, rows.filter((row) => isShown(row, show2, pins2)).length]));
function tally(rows, namesOf2) {
  const counts = /* @__PURE__ */ new Map();
  for (const row of rows) for (const name of namesOf2(row)) counts.set(name, (counts.get(name) ?? 0) + 1);
  return [...counts].sort((a5, b3) => b3[1] - a5[1] || (a5[0] < b3[0] ? -1 : 1));
}
function filterText({ show: show2, machine, robot, text: text2 }) {
  const parts = [
    show2 === "all" ? "" : SHOWN_NAMES[show2].toLowerCase(),
    machine === null ? "" : `of ${machine}`,
    robot === null ? "" : `with ${robot}`,
    text2 && `with “${text2}”`
  ];
  return parts.filter(Boolean).join(" and ");
}
function secondsOf(row, now) {
  if (row.began === null) return null;
  const runs2 = standing(row) === "live";
  const end = row.ended ?? (runs2 ? now * 1e6 : row.last);
  return end === null ? null : Math.max(0, (end - row.began) / 1e9);
}
function beganText(ns, today) {
  const date = new Date(ns / 1e6);
  if (date.toDateString() === today.toDateString())
    return date.toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit" });
  return date.toLocaleDateString("en-GB", { day: "numeric", month: "short", year: "numeric" });
}
function outageText({ outages }) {
  if (outages.length === 0) return "";
  const gone = outages.reduce((sum, [from, to]) => sum + to - from, 0);
  const times = outages.length > 1 ? `${outages.length} outages, ` : "";
  return `resumed after ${times}${duration(gone)}`;
}

// src/core/share.ts
async function copyText(text2, told = "Copied", otherwise = "mark the text and copy it") {
  try {
    await navigator.clipboard.writeText(text2);
    store.view.notify(told);
  } catch {
    store.view.notify(`This browser lets no page copy here: ${otherwise}`, "error");
  }
}
var KEPT_MS = 1e4;
function saveFile(content, name) {
  const link2 = document.createElement("a");
  link2.href = URL.createObjectURL(content);
  link2.download = name;
  link2.click();
  setTimeout(() => URL.revokeObjectURL(link2.href), KEPT_MS);
}

// src/panels/run_rows.tsx
var SIGNS = {
  live: "●",
  success: "✓",
  failure: "✕",
  preempted: "⊘",
  other: "·",
  cut: "…",
  interrupted: "‖",
  queued: "…"
};
var WORDS = { live: "running", interrupted: "interrupted", queued: "queued" };
var KINDS = { live: "active", cut: "waiting", interrupted: "waiting", queued: "waiting" };
function Rows2({ rows, pins: pins2 }) {
  const today = /* @__PURE__ */ new Date();
  return /* @__PURE__ */ a4("table", { class: "runs", children: [
    /* @__PURE__ */ a4("thead", { children: /* @__PURE__ */ a4("tr", { children: [
      /* @__PURE__ */ a4("th", { children: /* @__PURE__ */ a4("span", { class: "hidden", children: "pinned" }) }),
      /* @__PURE__ */ a4("th", { children: "Outcome" }),
      /* @__PURE__ */ a4("th", { children: "Machine and reason" }),
      /* @__PURE__ */ a4("th", { class: "right", children: "Duration" }),
      /* @__PURE__ */ a4("th", { children: "States" }),
      /* @__PURE__ */ a4("th", { class: "right", children: "Began" })
    ] }) }),
    /* @__PURE__ */ a4("tbody", { children: rows.map((row) => /* @__PURE__ */ a4(Row, { row, pinned: pins2.has(pinOf(row)), today }, row.id)) })
  ] });
}
var UNNAMED = "SM_ROOT";
var whoseText = (row) => row.robots.join(", ") || (row.live && row.name && row.name !== row.machine && row.name !== titleOf(row) ? row.name : "");
var titleOf = (row) => row.machine === UNNAMED && row.name ? row.name : row.machine;
function Row({ row, pinned, today }) {
  const kind = standing(row);
  const known2 = row.problem ? "unreadable" : shorten(row.outcome ?? "no end", 20);
  const colour = row.asks ? "waiting" : KINDS[kind] ?? kind;
  const word = row.asks ? "asks you" : WORDS[kind] ?? known2;
  const seconds = secondsOf(row, Date.now());
  const opens = row.name !== null || row.file !== "";
  const open = () => opens && openRun(row.id);
  const onKeyDown = (e4) => {
    if (e4.key === "Enter" && e4.target === e4.currentTarget) open();
  };
  const pin = (e4) => {
    e4.stopPropagation();
    store.view.togglePin(pinOf(row));
  };
  const outage = outageText(row);
  const classes = `${row.problem ? "bad" : ""}${opens ? "" : " closed"}`;
  return /* @__PURE__ */ a4("tr", { tabindex: 0, class: classes, onClick: open, onKeyDown, children: [
    /* @__PURE__ */ a4("td", { children: /* @__PURE__ */ a4(
      "button",
      {
        class: pinned ? "pin on" : "pin",
        "aria-pressed": pinned,
        title: pinned ? "pinned" : "pin",
        "aria-label": `pin ${row.machine}`,
        onClick: pin,
        children: pinned ? "★" : "☆"
      }
    ) }),
    /* @__PURE__ */ a4("td", { children: /* @__PURE__ */ a4("span", { class: `pill-text ${colour}`, children: [
      row.asks ? "?" : SIGNS[kind],
      " ",
      word
    ] }) }),
    /* @__PURE__ */ a4("td", { class: "what", children: [
      /* @__PURE__ */ a4("b", { children: shorten(titleOf(row), 40) }),
      " ",
      /* @__PURE__ */ a4("span", { class: "hint", children: whoseText(row) }),
      outage && /* @__PURE__ */ a4("span", { class: "pill-text waiting", children: outage }),
      " ",
      /* @__PURE__ */ a4(MissionButtons, { row }),
      /* @__PURE__ */ a4("small", { title: row.problem || row.reason, children: shorten(row.problem || row.reason, 110) })
    ] }),
    /* @__PURE__ */ a4("td", { class: "right", children: seconds === null ? "" : duration(seconds) }),
    /* @__PURE__ */ a4("td", { class: "strip-cell", children: /* @__PURE__ */ a4(Strip2, { row, seconds }) }),
    /* @__PURE__ */ a4("td", { class: "right", children: row.began === null ? "" : beganText(row.began, today) })
  ] });
}
function askForMission(row, mission, what) {
  const robots = row.robots.length ? ` on ${row.robots.join(", ")}` : "";
  const where = mission.active.length ? ` in ${mission.active.map(lastWord).join(", ")}` : "";
  const resumes = what === "resume";
  const now = () => store.data.runs.value.runs.find((one) => one.mission?.id === mission.id)?.mission;
  askFirst({
    title: `${resumes ? "Resume" : "Cancel"} ${row.machine}${robots}?`,
    yes: resumes ? "Resume" : "Cancel the mission",
    lines: () => [
      `The mission ${mission.id} is ${mission.status}${where}.`,
      resumes ? "A process on the viewer's computer goes on with it at once, and moves its robots." : "It is preempted, now or when it is resumed, and ends."
    ],
    situation: () => JSON.stringify([store.view.pageShown.value, now()?.status, now()?.can]),
    give: () => commandMission(mission, what)
  });
}
function MissionButtons({ row }) {
  const { mission } = row;
  if (!mission?.can.length || !hasToken()) return null;
  return mission.can.map((what) => {
    const onClick = (e4) => {
      e4.stopPropagation();
      askForMission(row, mission, what);
    };
    return /* @__PURE__ */ a4($, { children: [
      " ",
      /* @__PURE__ */ a4("button", { class: "small", "aria-label": `${what} ${mission.id}`, onClick, children: what === "resume" ? "Resume" : "Cancel" })
    ] });
  });
}
function Strip2({ row, seconds }) {
  if (!seconds) return null;
  const rows = row.strip.reduce((most, [at]) => Math.max(most, at + 1), 1);
  const tall = 24 / rows;
  const bar = ([at, name, from, to, kind]) => {
    const x3 = 100 * from / seconds;
    const wide = Math.max(0.6, 100 * ((to ?? seconds) - from) / seconds - 0.4);
    return /* @__PURE__ */ a4(
      "rect",
      {
        class: kind,
        x: `${x3}%`,
        y: at * tall + 1,
        width: `${wide}%`,
        height: Math.max(2, tall - 2),
        rx: rows > 2 ? 0 : 3,
        children: /* @__PURE__ */ a4("title", { children: [
          name,
          ": ",
          duration((to ?? seconds) - from)
        ] })
      }
    );
  };
  const gap = ([from, to]) => {
    const [x3, wide] = [100 * from / seconds, Math.max(0.8, 100 * (to - from) / seconds)];
    return /* @__PURE__ */ a4("rect", { class: "outage", x: `${x3}%`, y: "0", width: `${wide}%`, height: "24", children: /* @__PURE__ */ a4("title", { children: [
      "no process ran it for ",
      duration(to - from)
    ] }) });
  };
  const names = row.strip.slice(0, 12).map((piece) => piece[1]);
  return /* @__PURE__ */ a4("svg", { class: "run-strip", height: "24", role: "img", "aria-label": names.join(", "), children: [
    row.strip.map(bar),
    row.outages.map(gap)
  ] });
}

// src/panels/home.tsx
var MOST_ROWS3 = 40;
var MOST_NAMES2 = 8;
var REFRESH_MS3 = 5e3;
var HomePage = () => store.view.pageShown.value === "runs" ? /* @__PURE__ */ a4(OpenHome, {}) : null;
var ALL = { show: "all", machine: null, robot: null, text: "" };
function OpenHome() {
  const [filter, setFilter] = d2(ALL);
  const [most, setMost] = d2(MOST_ROWS3);
  const heading = T2(null);
  const { machines } = store.data;
  A2(() => heading.current?.focus(), []);
  A2(() => {
    refreshRuns();
  }, [machines.value]);
  const { runs: runs2, folders, journals } = store.data.runs.value;
  A2(() => {
    if (!journals.length) return;
    const timer = setInterval(refreshRuns, REFRESH_MS3);
    return () => clearInterval(timer);
  }, [journals.length > 0]);
  store.playback.watchSlowly();
  const pins2 = store.view.pins.value;
  const rows = chosen(runs2, filter, pins2);
  const change3 = (some) => {
    setFilter({ ...filter, ...some });
    setMost(MOST_ROWS3);
  };
  const failed = rows.filter((row) => standing(row) === "failure").length;
  const failedText = failed ? `, ${failed} failed` : "";
  return /* @__PURE__ */ a4("section", { class: "home", "aria-labelledby": "home-title", children: [
    /* @__PURE__ */ a4(Filters, { runs: runs2, filter, pins: pins2, onChange: change3 }),
    /* @__PURE__ */ a4("div", { class: "run-list", children: [
      /* @__PURE__ */ a4("header", { children: [
        /* @__PURE__ */ a4("h2", { id: "home-title", tabindex: -1, ref: heading, children: "Runs" }),
        folders.map((one) => /* @__PURE__ */ a4("span", { class: "chip", title: one, children: [
          "folder ",
          shorten(endOfPath(one, folders), 32)
        ] })),
        journals.map((one) => /* @__PURE__ */ a4(JournalChip, { ...one })),
        /* @__PURE__ */ a4("span", { class: "spread" }),
        /* @__PURE__ */ a4("span", { class: "hint", role: "status", children: store.data.runsKnown.value ? `${rows.length.toLocaleString("en")} run${rows.length === 1 ? "" : "s"}${failedText}` : "reading the runs…" }),
        /* @__PURE__ */ a4(
          "input",
          {
            placeholder: "machine, robot, state, reason",
            "aria-label": "search runs",
            value: filter.text,
            onInput: (e4) => change3({ text: fieldValue(e4) })
          }
        ),
        runs2.filter((row) => row.live).length > 1 && /* @__PURE__ */ a4("button", { onClick: () => showPage("fleet"), children: "Fleet" }),
        /* @__PURE__ */ a4("button", { onClick: () => showPage("simulate"), children: "Simulate" }),
        store.data.model.value && /* @__PURE__ */ a4("button", { onClick: () => showPage("machine"), children: "Close" })
      ] }),
      store.data.runsProblem.value && /* @__PURE__ */ a4("p", { class: "error", children: store.data.runsProblem.value }),
      !runs2.length && store.data.runsKnown.value && /* @__PURE__ */ a4(NoRuns, {}),
      runs2.length > 0 && !rows.length && /* @__PURE__ */ a4("div", { class: "empty-list", children: [
        /* @__PURE__ */ a4("p", { children: [
          "No run is ",
          filterText(filter),
          "."
        ] }),
        /* @__PURE__ */ a4("button", { onClick: () => setFilter(ALL), children: "Clear filters" })
      ] }),
      rows.length > 0 && /* @__PURE__ */ a4(Rows2, { rows: rows.slice(0, most), pins: pins2 }),
      /* @__PURE__ */ a4(More, { left: rows.length - most, onMore: () => setMost(most + 200) })
    ] })
  ] });
}
var JournalChip = ({ name, problem }) => /* @__PURE__ */ a4("span", { class: problem ? "chip bad" : "chip", title: problem || name, children: [
  "journal ",
  shorten(lastWord(name), 24),
  problem && ": not readable"
] });
function NoRuns() {
  const text2 = "smachpy run patrol --start-robot --view";
  return /* @__PURE__ */ a4("div", { class: "empty-list", children: [
    /* @__PURE__ */ a4("p", { children: "No runs yet. Make one:" }),
    /* @__PURE__ */ a4("p", { children: [
      /* @__PURE__ */ a4("code", { children: text2 }),
      " ",
      /* @__PURE__ */ a4("button", { class: "small", onClick: () => copyText(text2), children: "Copy" })
    ] })
  ] });
}
function Filters({
  runs: runs2,
  filter,
  pins: pins2,
  onChange
}) {
  const counts = countsOf(runs2, pins2);
  const choice = (name, count, on2, choose2) => /* @__PURE__ */ a4("li", { children: /* @__PURE__ */ a4("button", { class: on2 ? "on" : "", "aria-pressed": on2, onClick: choose2, children: [
    /* @__PURE__ */ a4("span", { children: shorten(name, 24) }),
    /* @__PURE__ */ a4("span", { class: "number", children: count })
  ] }) });
  const names = (what, found) => found.length > 0 && /* @__PURE__ */ a4($, { children: [
    /* @__PURE__ */ a4("h3", { children: what === "machine" ? "Machine" : "Robot" }),
    /* @__PURE__ */ a4("ul", { children: found.slice(0, MOST_NAMES2).map(
      ([name, count]) => choice(
        name,
        count,
        filter[what] === name,
        () => onChange({ [what]: filter[what] === name ? null : name })
      )
    ) })
  ] });
  return /* @__PURE__ */ a4("nav", { class: "filters", "aria-label": "filters", children: [
    /* @__PURE__ */ a4("h3", { children: "Show" }),
    /* @__PURE__ */ a4("ul", { children: SHOWN.filter((show2) => show2 === "all" || (counts.get(show2) ?? 0) > 0 || filter.show === show2).map(
      (show2) => choice(SHOWN_NAMES[show2], counts.get(show2) ?? 0, filter.show === show2, () => onChange({ show: show2 }))
    ) }),
    names(
      "machine",
      tally(runs2, (row) => [row.machine])
    ),
    names(
      "robot",
      tally(runs2, (row) => row.robots)
    )
  ] });
}

// src/panels/comparison.tsx
var MOST4 = 60;
async function compare(page2, name) {
  if (!name) {
    if (!store.data.comparison.value) return;
    const { alone: alone2 } = store.data.comparison.value;
    store.data.comparison.value = null;
    show(page2, alone2);
    return;
  }
  const asked2 = store.data.facts.value?.name;
  const found = await ask(link("compare", `&with=${encoded(name)}`));
  const model = store.data.model.value;
  if (!model || asked2 !== store.data.facts.value?.name) return;
  if (isFailure(found)) {
    store.view.notify(found.text, "error");
    return;
  }
  const alone = store.data.comparison.value?.alone ?? model.payload;
  const compared = { ...found, model: found.model };
  store.data.comparison.value = { ...compared, alone };
  show(page2, compared.model);
}
function show(page2, payload) {
  const opened2 = store.view.opened.value;
  store.view.setModel(payload);
  store.view.keepOpened(new Set([...opened2].filter((path) => store.data.model.value?.get(path)?.children.length)));
  page2.select(null);
  page2.layouts.layout?.forget();
  page2.layouts.relayout({ frame: true });
}
function CompareLine({ page: page2, onDone }) {
  const others = store.data.machines.value.filter((machine) => machine.name !== store.data.facts.value?.name);
  if (isFile() || !store.data.model.value) return null;
  const title = others.length ? "" : "no other machine or recording here; try: smachpy view old.jsonl new.jsonl";
  const choose2 = (e4) => {
    compare(page2, fieldValue(e4));
    onDone();
  };
  return /* @__PURE__ */ a4("label", { class: "line", children: [
    /* @__PURE__ */ a4("span", { children: "Compare with" }),
    /* @__PURE__ */ a4(
      "select",
      {
        id: "compare",
        value: store.data.comparison.value?.with ?? "",
        disabled: !others.length,
        title,
        onChange: choose2,
        children: [
          /* @__PURE__ */ a4("option", { value: "", children: others.length ? "nothing" : "nothing else here" }),
          others.map(({ name }) => /* @__PURE__ */ a4("option", { value: name, children: name }))
        ]
      }
    )
  ] });
}
function CompareChip({ page: page2 }) {
  const found = store.data.comparison.value;
  if (!found) return null;
  return /* @__PURE__ */ a4("button", { class: "chip compare-chip", title: "show it alone again", onClick: () => compare(page2, ""), children: [
    "compared with ",
    found.with,
    " ✕"
  ] });
}
function Differences({ page: page2 }) {
  const found = store.data.comparison.value;
  const [all, setAll] = d2(false);
  if (!found) return null;
  const shown = all ? found.listed : found.listed.slice(0, MOST4);
  const [before, now] = found.runs;
  const runs2 = before && now ? ` (${before} runs) to this (${now}); ×: visits per run` : "";
  return /* @__PURE__ */ a4("section", { children: [
    /* @__PURE__ */ a4("h2", { children: [
      "Differences ",
      /* @__PURE__ */ a4("span", { class: "number", children: found.listed.length })
    ] }),
    /* @__PURE__ */ a4("p", { class: "hint", children: [
      "from ",
      found.with,
      runs2
    ] }),
    !found.listed.length && /* @__PURE__ */ a4("p", { class: "hint", children: "no notable difference" }),
    /* @__PURE__ */ a4("ul", { class: "differences", children: shown.map((one) => /* @__PURE__ */ a4(Difference, { one, page: page2 })) }),
    /* @__PURE__ */ a4(More, { left: found.listed.length - shown.length, onMore: () => setAll(true) })
  ] });
}
var Difference = ({ one, page: page2 }) => /* @__PURE__ */ a4("li", { class: one.change, children: [
  /* @__PURE__ */ a4("b", { "aria-hidden": "true", children: CHANGE_SIGNS[one.change] }),
  /* @__PURE__ */ a4("span", { children: [
    /* @__PURE__ */ a4(StateLink, { path: one.path, page: page2 }),
    /* @__PURE__ */ a4("span", { class: "hidden", children: [
      " ",
      one.change
    ] }),
    one.text !== one.change ? ` ${shorten(one.text, 300)}` : ""
  ] })
] });

// src/core/log_lines.ts
var LINES = {
  Started: () => ["started", "active"],
  Recovered: (e4) => [`resumed after an outage of ${outageText2(e4)}`, "waiting"],
  Finished: (e4) => [`ended: ${e4.outcome || RAISED}`, outcomeClass(e4.outcome || RAISED)],
  Left: (e4) => [e4.outcome, outcomeClass(e4.outcome)],
  Failed: (e4) => [e4.error, "failure"],
  PreemptRequested: (e4) => [requestText(e4), "preempted"],
  PreemptServiced: () => ["preempt serviced", "preempted"],
  Abandoned: (e4) => [`abandoned after ${e4.grace} s`, "failure"],
  TimedOut: (e4) => [`timeout of ${e4.timeout} s`, "preempted"],
  Retried: (e4) => [`retry: ${e4.reason}`, "preempted"],
  Iterated: (e4) => [`item ${e4.number + 1}`, "other"],
  ResourceUse: (e4) => [resourceText(e4), e4.status === "holds" || e4.status === "free" ? "other" : "waiting"],
  Noted: (e4) => [e4.text, "other"],
  CallbackFailed: (e4) => [`${e4.callback}: ${e4.error}`, "failure"],
  Paused: (e4) => [`paused (${e4.reason})`, "waiting"],
  Resumed: () => ["resumed", "active"],
  Jumped: (e4) => [`jump to ${e4.label}`, "waiting"],
  Fired: (e4) => [`${e4.transition} fired`, "other"],
  HeldBack: (e4) => [`waits: ${heldText(e4)}`, "waiting"],
  QuestionAsked: (e4) => [`asks ${e4.text}`.trim(), "waiting"],
  QuestionAnswered: (e4) => [e4.by ? `answered ${e4.answer} by ${e4.by}` : `nobody answered: ${e4.answer}`, "waiting"],
  OutcomeForced: (e4) => [`forced: ${e4.outcome}`, "waiting"],
  GoalSent: (e4) => [goalText2(e4), "active"],
  GoalDone: (e4) => [`${e4.action}: ${e4.status.toLowerCase()} ${e4.text}`.trim(), outcomeClass(e4.status)],
  UserdataWritten: (e4) => [`${e4.key} = ${brief(e4.value).slice(0, 60)}`, "other"]
};
function outageText2({ outages }) {
  const [from, to] = outages?.at(-1) ?? [0, 0];
  return duration((to - from) / 1e9);
}
function goalText2(e4) {
  const purpose = purposeOf(e4.goal_id, e4);
  return `goal to ${e4.action}${purpose && ` → ${purpose}`}`;
}
function heldText({ guards, truths }) {
  const text2 = (guard, i4) => `[${guard}] is false${truths?.[i4] ? ` (${truths[i4]})` : ""}`;
  return guards.map(text2).join(", ");
}
function requestText(e4) {
  const asker = askerText(requestOf(e4));
  return `asked to stop${asker ? ` by ${asker}` : ""}${e4.grace != null ? `, within ${duration(e4.grace)}` : ""}`;
}
function lineOf(e4, node) {
  const line = LINES[e4.kind];
  const [text2, kind] = line?.(e4) ?? [e4.kind, "other"];
  if (e4.kind === "Fired") {
    const name = node?.children.find(({ label }) => label === e4.transition)?.name;
    return { text: name ? `${name} fired` : text2, kind };
  }
  return { text: text2, kind: e4.kind === "Left" ? endClass(node, e4.outcome) : kind };
}
var KINDS_OF = {
  all: new Set(Object.keys(LINES).filter((kind) => kind !== "UserdataWritten")),
  transitions: /* @__PURE__ */ new Set(["Started", "Recovered", "Finished", "Left", "Failed"]),
  goals: /* @__PURE__ */ new Set(["GoalSent", "GoalDone"]),
  userdata: /* @__PURE__ */ new Set(["UserdataWritten"]),
  trouble: /* @__PURE__ */ new Set([
    "Failed",
    "PreemptRequested",
    "PreemptServiced",
    "Abandoned",
    "TimedOut",
    "Retried",
    "CallbackFailed"
  ])
};

// src/panels/log.tsx
var LINES2 = 70;
var LOOKED_AT = 6e3;
var LONGEST = 200;
function Log({ page: page2 }) {
  store.playback.watchSlowly();
  const [text2, setText] = d2("");
  const [pages, setPages] = d2(1);
  const end = store.playback.eventsShown();
  const first = Math.max(0, end - pages * LOOKED_AT);
  const most = pages * LINES2;
  const wanted = text2.toLowerCase();
  const kinds = KINDS_OF[store.view.logFilter.value];
  const lines = [];
  let i4 = end - 1;
  for (; i4 >= first && lines.length < most; i4--) {
    const e4 = store.data.run.events[i4];
    const missing = i4 + 1 < end ? store.data.run.events[i4 + 1].dropped ?? 0 : 0;
    if (missing)
      lines.push(
        /* @__PURE__ */ a4("li", { class: "hint", children: [
          countOfEvents(missing),
          " missing here"
        ] }, -e4.seq)
      );
    if (!kinds.has(e4.kind)) continue;
    const line = lineOf(e4, store.data.model.value?.get(e4.path));
    if (wanted && !`${e4.path} ${line.text}`.toLowerCase().includes(wanted)) continue;
    const count = i4 + 1;
    const onClick = () => {
      if (store.playback.cursor.value !== null) store.playback.seekTo(count);
    };
    const t4 = e4.stamp_ns / 1e6;
    lines.push(
      /* @__PURE__ */ a4(
        "li",
        {
          class: store.pointer.isLit(e4.path, t4) ? "lit" : "",
          onClick,
          ...store.pointer.hoverHandlers(e4.path, t4),
          children: [
            /* @__PURE__ */ a4("time", { children: store.clock.instantText(t4, 2) }),
            /* @__PURE__ */ a4(StateLink, { path: e4.path, page: page2, tabindex: lines.length ? -1 : 0 }),
            " ",
            /* @__PURE__ */ a4("span", { class: `word ${line.kind}`, children: shorten(line.text, LONGEST) }),
            targetOf(e4)
          ]
        },
        e4.seq
      )
    );
  }
  const oldest = store.data.run.events[0];
  const before = oldest && i4 < 0 ? oldest.seq - 1 - (oldest.dropped ?? 0) : 0;
  if (before > 0)
    lines.push(
      /* @__PURE__ */ a4("li", { class: "hint", children: [
        "of ",
        countOfEvents(before),
        " before, only counts and newest values are kept"
      ] }, "before")
    );
  const all = end.toLocaleString("en");
  const nothing = `nothing more in the last ${(end - first).toLocaleString("en")} of ${all} events; look at older ones`;
  return /* @__PURE__ */ a4(Section, { title: "Log", children: [
    /* @__PURE__ */ a4("div", { class: "filter", children: [
      /* @__PURE__ */ a4("select", { "aria-label": "kinds", value: store.view.logFilter.value, onChange: chooseKinds, children: Object.keys(KINDS_OF).map((name) => /* @__PURE__ */ a4("option", { value: name, children: name })) }),
      /* @__PURE__ */ a4(
        "input",
        {
          "aria-label": "filter the log",
          placeholder: "filter",
          value: text2,
          onInput: (e4) => setText(fieldValue(e4))
        }
      )
    ] }),
    /* @__PURE__ */ a4("ol", { class: "log", onKeyDown: moveFocus, children: lines }),
    i4 >= 0 && /* @__PURE__ */ a4("button", { class: "small", onClick: () => setPages(pages + 1), children: lines.length < most ? nothing : "older" })
  ] });
}
function moveFocus(e4) {
  const step = { ArrowDown: 1, ArrowUp: -1 }[e4.key];
  if (!step) return;
  const links = [...e4.currentTarget.querySelectorAll("button")];
  const at = links.indexOf(document.activeElement);
  links[at + step]?.focus();
  e4.preventDefault();
  e4.stopPropagation();
}
var chooseKinds = (e4) => {
  store.view.logFilter.value = fieldValue(e4);
};
function targetOf(e4) {
  if (e4.kind !== "Left") return "";
  const node = store.data.model.value?.get(e4.path);
  const link2 = node && store.data.model.value?.linkOf(node, e4.outcome);
  return link2 && link2.target !== e4.outcome ? ` → ${shorten(link2.target)}` : "";
}

// src/drawing/sketch.ts
var LEAST = 6;
var NAME2 = 11;
function sketch(g5, diagram, { x: x3, y: y5, k: k4 }, part) {
  const looks = /* @__PURE__ */ new Map();
  g5.save();
  g5.beginPath();
  g5.rect(0, 0, part.w, part.h);
  g5.clip();
  g5.translate(x3, y5);
  g5.scale(k4, k4);
  for (const [path, { group, frame, node }] of diagram.picture.states) {
    const box = diagram.boxOf(path);
    const title = group.querySelector(".title, .name");
    if (!box || !title) continue;
    const [left, top, w5, h5] = [box.x * k4 + x3, box.y * k4 + y5, box.w * k4, box.h * k4];
    if (left > part.w || top > part.h || left + w5 < 0 || top + h5 < 0) continue;
    const name = `${group.getAttribute("class")} ${node.depth}`;
    let look = looks.get(name);
    if (!look) {
      const { fill, stroke, strokeWidth } = getComputedStyle(frame);
      look = { fill, stroke, width: Number.parseFloat(strokeWidth), ink: getComputedStyle(title).fill };
      looks.set(name, look);
    }
    g5.fillStyle = look.fill;
    g5.fillRect(box.x, box.y, box.w, box.h);
    g5.strokeStyle = look.stroke;
    g5.lineWidth = look.width;
    g5.strokeRect(box.x, box.y, box.w, box.h);
    const own2 = Number.parseFloat(title.style.fontSize);
    if ((own2 || NAME2) * k4 < LEAST) continue;
    g5.fillStyle = look.ink;
    g5.font = `620 ${own2 || NAME2}px Inter, Arial, sans-serif`;
    g5.textBaseline = own2 ? "middle" : "alphabetic";
    g5.fillText(node.shown, Number(title.getAttribute("x")), Number(title.getAttribute("y")));
  }
  g5.restore();
}

// src/drawing/film.ts
var LAST_MS = 2e4;
var WIDEST = 960;
var HEAD5 = 32;
var FONTS_MS = 150;
var MOST_IN_IMAGE = 1e3;
var SUFFIXES = { "image/gif": "gif", "video/mp4": "mp4" };
var makesVideos = () => "VideoEncoder" in globalThis;
async function saveFilm(page2, kind) {
  const { run } = store.data;
  store.playback.playing.value = null;
  const shown = store.playback.cursor.value;
  const to = store.playback.nowMs();
  const stretch = store.playback.stretch.value ?? { from: Math.max(run.first() ?? to, to - LAST_MS), to };
  if (store.playback.filmed.value !== null || stretch.from >= stretch.to) return;
  const name = page2.fileName();
  store.playback.filmed.value = 0;
  try {
    const film = await draw(page2, kind, stretch, () => run === store.data.run && store.playback.filmed.value !== null);
    if (film) saveFile(new Blob([film.data], { type: film.type }), `${name}.${SUFFIXES[film.type]}`);
  } catch (error) {
    store.view.notify(`No film: ${messageOf(error)}`, "error");
  } finally {
    store.playback.filmed.value = null;
    if (run === store.data.run) store.playback.seek(shown);
  }
}
async function draw(page2, kind, stretch, isWanted) {
  const instants2 = framesOf(stretch);
  const style = await styleText();
  const canvas2 = document.createElement("canvas");
  const g5 = canvas2.getContext("2d", { willReadFrequently: true });
  const worker = await makeWorker("film");
  const ask2 = (told, transfer = []) => new Promise((done, failed) => {
    worker.onmessage = ({ data }) => "error" in data ? failed(new Error(data.error)) : done(data.film);
    worker.onerror = (e4) => failed(new Error(e4.message || "the encoder cannot be started"));
    worker.postMessage(told, transfer);
  });
  try {
    await ask2({ kind, frameMs: FILM_FRAME_MS });
    for (const [i4, t4] of instants2.entries()) {
      if (!isWanted()) return null;
      store.playback.seek(t4);
      await paint(page2, canvas2, style, i4 === 0);
      const { data, width, height } = g5.getImageData(0, 0, canvas2.width, canvas2.height);
      await ask2({ data, width, height }, [data.buffer]);
      if (isWanted()) store.playback.filmed.value = Math.round(100 * (i4 + 1) / instants2.length);
    }
    return await ask2("end");
  } finally {
    worker.terminate();
  }
}
async function paint(page2, canvas2, style, isFirst) {
  const { svg: svg2 } = page2.diagram;
  const [floor3, timeline] = [page2.map.canvas, page2.timeline.canvas];
  const stage = { w: svg2.clientWidth, h: svg2.clientHeight };
  const wide = stage.w + floor3.clientWidth;
  const below = timeline.clientWidth ? timeline.clientHeight * wide / timeline.clientWidth : 0;
  const scale = Math.min(1, WIDEST / wide);
  const [width, height] = [wide * scale, (HEAD5 + stage.h + below) * scale].map((size) => 2 * Math.round(size / 2));
  if (isFirst) Object.assign(canvas2, { width, height });
  const isLarge = page2.diagram.picture.states.size > MOST_IN_IMAGE;
  let picture = isLarge ? null : await pictureOf(svg2, style);
  if (picture && isFirst) {
    await new Promise((done) => setTimeout(done, FONTS_MS));
    picture = await pictureOf(svg2, style);
  }
  const g5 = canvas2.getContext("2d");
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);
  g5.setTransform(1, 0, 0, 1, 0, 0);
  g5.fillStyle = colour("--background");
  g5.fillRect(0, 0, canvas2.width, canvas2.height);
  g5.scale(scale, scale);
  g5.fillStyle = colour("--ink");
  g5.textBaseline = "middle";
  g5.font = "660 15px Inter, Arial, sans-serif";
  g5.fillText(page2.title(), 12, HEAD5 / 2);
  g5.textAlign = "right";
  g5.font = "600 15px 'JetBrains Mono', monospace";
  g5.fillText(store.clock.instantText(store.playback.nowMs()), wide - 12, HEAD5 / 2);
  g5.textAlign = "left";
  if (picture) g5.drawImage(picture, 0, HEAD5, stage.w, stage.h);
  else {
    g5.translate(0, HEAD5);
    sketch(g5, page2.diagram, page2.view, stage);
    g5.translate(0, -HEAD5);
  }
  if (floor3.clientWidth) g5.drawImage(floor3, stage.w, HEAD5, floor3.clientWidth, floor3.clientHeight);
  if (below) g5.drawImage(timeline, 0, HEAD5 + stage.h, wide, below);
}
async function pictureOf(svg2, style) {
  const copy2 = svg2.cloneNode(true);
  const [width, height] = [svg2.clientWidth, svg2.clientHeight];
  copy2.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  copy2.setAttribute("width", String(width));
  copy2.setAttribute("height", String(height));
  copy2.dataset.theme = isDark() ? "dark" : "light";
  const sheet = document.createElementNS("http://www.w3.org/2000/svg", "style");
  sheet.textContent = `${style} svg.diagram { width: ${width}px; height: ${height}px; }`;
  copy2.prepend(sheet);
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(new XMLSerializer().serializeToString(copy2))}`;
  await image.decode();
  return image;
}
async function styleText() {
  const rules = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules].map((rule) => rule.cssText));
  const wanted = rules.filter((rule) => !rule.startsWith("@font-face") || rule.includes("Inter"));
  const text2 = wanted.join("\n");
  const [, address] = /url\("([^"]+inter\.woff2)"\)/.exec(text2) ?? [];
  if (!address) return text2;
  const font2 = await (await fetch(address)).blob();
  const data = await new Promise((done) => {
    const reader = new FileReader();
    reader.onload = () => done(String(reader.result));
    reader.readAsDataURL(font2);
  });
  return text2.replace(address, data);
}

// src/panels/notes.tsx
function ShareButtons({ page: page2 }) {
  const told = isFile() ? "Link copied, for who has this file" : "Link copied";
  const copy2 = () => copyText(page2.address.text, told, "the address bar shows the link");
  const share = () => {
    const saved2 = document.createElement("a");
    saved2.href = link("export", `&format=html&view=${encoded(page2.address.fragment)}`);
    saved2.download = "";
    saved2.click();
  };
  const done = store.playback.filmed.value;
  const films = [["gif", "GIF"], ...makesVideos() ? [["video", "Video"]] : []];
  const stop = () => {
    store.playback.filmed.value = null;
  };
  return /* @__PURE__ */ a4("span", { class: "share", children: [
    done === null ? films.map(([kind, name]) => /* @__PURE__ */ a4(
      "button",
      {
        class: "film",
        title: `${name} of the selected stretch, or of the 20 s before the instant shown`,
        onClick: () => saveFilm(page2, kind),
        children: name
      },
      kind
    )) : /* @__PURE__ */ a4("button", { class: "on", title: "stop", onClick: stop, children: [
      done,
      " % ✕"
    ] }),
    /* @__PURE__ */ a4("button", { title: "note at the instant shown (n)", onClick: () => store.notes.begin(), children: "Note" }),
    /* @__PURE__ */ a4(
      "button",
      {
        title: "copy the address of this view: instant, selection, open containers, notes of this browser",
        onClick: copy2,
        children: "Link"
      }
    ),
    !isFile() && /* @__PURE__ */ a4("button", { title: "one HTML file that opens at this instant, with the notes, without a server", onClick: share, children: "Share" })
  ] });
}
function NoteDialog() {
  const [text2, setText] = d2("");
  const at = store.notes.writtenAt.value;
  if (at === null) return null;
  const close2 = () => {
    store.notes.writtenAt.value = null;
    setText("");
  };
  const onSubmit = (e4) => {
    e4.preventDefault();
    addNote({ at, text: text2.trim() });
    close2();
  };
  return /* @__PURE__ */ a4(Dialog, { label: "note", class: "note-form", onClose: close2, children: /* @__PURE__ */ a4("form", { onSubmit, children: [
    /* @__PURE__ */ a4("h2", { children: [
      "Note at ",
      store.clock.instantText(at)
    ] }),
    /* @__PURE__ */ a4(
      "input",
      {
        "aria-label": "note",
        maxlength: 300,
        autocomplete: "off",
        value: text2,
        autofocus: true,
        onInput: (e4) => setText(fieldValue(e4))
      }
    ),
    /* @__PURE__ */ a4("p", { class: "hint", children: isShared() ? "All pages of this run show it." : isFile() ? "This page forgets it." : "Only this browser keeps it; with the token for commands, all pages of this run show it." }),
    /* @__PURE__ */ a4("p", { children: [
      /* @__PURE__ */ a4("button", { class: "primary", type: "submit", disabled: !text2.trim(), children: "Pin it" }),
      " ",
      /* @__PURE__ */ a4("button", { type: "button", onClick: close2, children: "Cancel" })
    ] })
  ] }) });
}
function Notes2() {
  const notes = store.notes.all.value;
  if (!notes.length) return null;
  return /* @__PURE__ */ a4(Section, { title: "Notes", count: notes.length, children: /* @__PURE__ */ a4("ul", { class: "notes", children: notes.map((note) => /* @__PURE__ */ a4("li", { children: [
    /* @__PURE__ */ a4("button", { class: "link", onClick: () => store.playback.seek(note.at), children: /* @__PURE__ */ a4("time", { children: store.clock.instantText(note.at) }) }),
    /* @__PURE__ */ a4("span", { title: note.by ? `by ${note.by}` : "only in this browser", children: note.text }),
    (note.by === void 0 || isShared()) && /* @__PURE__ */ a4("button", { class: "small", "aria-label": `remove the note ${note.text}`, onClick: () => removeNote(note), children: "✕" })
  ] }, `${note.at} ${note.text}`)) }) });
}

// src/panels/numbers.tsx
function Numbers() {
  store.playback.watchSlowly();
  if (store.view.numbers.value === "none") return null;
  const { taken, all } = coverage(store.data.model.value, store.playback.shown().states);
  const recorded = store.data.statistics.value;
  return /* @__PURE__ */ a4(Section, { title: "Numbers", children: /* @__PURE__ */ a4("dl", { class: "facts", children: [
    /* @__PURE__ */ a4("dt", { children: "transitions taken" }),
    /* @__PURE__ */ a4("dd", { children: [
      taken,
      " of ",
      all,
      " (",
      all ? Math.round(taken / all * 100) : 0,
      " %)"
    ] }),
    recorded && /* @__PURE__ */ a4($, { children: [
      /* @__PURE__ */ a4("dt", { children: "recorded runs" }),
      /* @__PURE__ */ a4("dd", { children: [
        recorded.runs,
        ", median ",
        duration(recorded.median ?? 0)
      ] }),
      /* @__PURE__ */ a4("dt", { children: "they ended" }),
      /* @__PURE__ */ a4("dd", { children: Object.entries(recorded.outcomes).map(([outcome, times]) => /* @__PURE__ */ a4($, { children: [
        /* @__PURE__ */ a4(Pill, { kind: outcomeClass(outcome), children: [
          outcome,
          " ×",
          times
        ] }),
        " "
      ] })) })
    ] })
  ] }) });
}

// src/panels/preempts.tsx
var RECENT_MS2 = 3e4;
var ORDINARY_MS = 1e3;
var MOST_ROWS4 = 24;
var isOrdinary = ({ from, to, rows }) => to !== null && to - from < ORDINARY_MS && rows.every((row) => row.asked?.source === "concurrence" && row.abandoned === null);
function Preempts({ page: page2, data, now }) {
  const found = store.data.run.preemptAt(now);
  if (!found || found.from < (ms(data.started) ?? 0)) return null;
  if (found.to !== null && data.ended == null && now - found.to > RECENT_MS2) return null;
  if (isOrdinary(found)) return null;
  const askers = [...new Set(found.rows.map((row) => askerText(row.asked) ?? "not recorded"))];
  const depth = (row) => row.path.split("/").length;
  const rows = [...found.rows].sort((a5, b3) => depth(a5) - depth(b3) || a5.preempt - b3.preempt).slice(0, MOST_ROWS4);
  const left = found.rows.length - rows.length;
  return /* @__PURE__ */ a4(Section, { title: "Preempt", children: /* @__PURE__ */ a4("div", { class: "preempt", children: [
    /* @__PURE__ */ a4("dl", { class: "facts", children: [
      /* @__PURE__ */ a4("dt", { children: "asked by" }),
      /* @__PURE__ */ a4("dd", { children: askers.map((one) => /* @__PURE__ */ a4("div", { children: one })) }),
      /* @__PURE__ */ a4("dt", { children: "first asked" }),
      /* @__PURE__ */ a4("dd", { children: [
        /* @__PURE__ */ a4(StateLink, { path: found.rows[0].path, page: page2 }),
        " ",
        duration((now - found.from) / 1e3),
        " ago"
      ] }),
      /* @__PURE__ */ a4(Length, { found, now, page: page2 })
    ] }),
    /* @__PURE__ */ a4("div", { class: "waterfall", role: "list", children: [
      rows.map((row) => /* @__PURE__ */ a4(Row2, { row, found, now, page: page2 })),
      left > 0 && /* @__PURE__ */ a4("div", { class: "hint", children: [
        "and ",
        left,
        " more"
      ] })
    ] }),
    /* @__PURE__ */ a4("p", { class: "hint key", children: [
      /* @__PURE__ */ a4("span", { children: [
        /* @__PURE__ */ a4("i", { class: "preempted" }),
        " asked, not serviced"
      ] }),
      /* @__PURE__ */ a4("span", { children: [
        /* @__PURE__ */ a4("i", { class: "asked" }),
        " until serviced"
      ] }),
      " ",
      /* @__PURE__ */ a4("span", { children: [
        /* @__PURE__ */ a4("i", { class: "success" }),
        " cleaning up"
      ] })
    ] })
  ] }) });
}
function Length({ found, now, page: page2 }) {
  if (found.to === null)
    return /* @__PURE__ */ a4($, { children: [
      /* @__PURE__ */ a4("dt", { children: "held up by" }),
      /* @__PURE__ */ a4("dd", { children: found.holds.map((row, i4) => /* @__PURE__ */ a4($, { children: [
        i4 > 0 ? ", " : "",
        /* @__PURE__ */ a4("b", { children: /* @__PURE__ */ a4(StateLink, { path: row.path, page: page2 }) }),
        " ",
        "for ",
        holdText(row, now)
      ] })) })
    ] });
  return /* @__PURE__ */ a4($, { children: [
    /* @__PURE__ */ a4("dt", { children: "took" }),
    /* @__PURE__ */ a4("dd", { children: [
      duration((found.to - found.from) / 1e3),
      "; longest: ",
      /* @__PURE__ */ a4(StateLink, { path: longest(found.rows).path, page: page2 })
    ] })
  ] });
}
function Row2({ row, found, now, page: page2 }) {
  const whole2 = Math.max((found.to ?? now) - found.from, 1);
  const at = (t4) => `${(t4 - found.from) / whole2 * 100}%`;
  const bar = (from, to, kind) => {
    const width = `${Math.max(1.5, (to - from) / whole2 * 100)}%`;
    return /* @__PURE__ */ a4("i", { class: kind, style: { left: at(from), width } });
  };
  const until = row.to ?? now;
  const answered = row.abandoned ?? row.serviced ?? until;
  const waits = row.to === null && row.serviced === null;
  return /* @__PURE__ */ a4("div", { role: "listitem", title: titleOf2(row), children: [
    /* @__PURE__ */ a4(StateLink, { path: row.path, page: page2 }),
    /* @__PURE__ */ a4("span", { "aria-hidden": "true", children: [
      bar(row.preempt, answered, waits ? "preempted" : "asked"),
      answered < until && bar(answered, until, row.abandoned !== null ? "failure" : "success"),
      row.serviced !== null && /* @__PURE__ */ a4("b", { style: { left: at(row.serviced) } })
    ] }),
    /* @__PURE__ */ a4("small", { children: rowText(row, found, now) })
  ] });
}
function rowText(row, found, now) {
  const since = (t4) => duration((now - t4) / 1e3);
  if (row.abandoned !== null) return "✕ abandoned";
  if (row.to !== null) return `✓ ${duration((row.to - row.preempt) / 1e3)}`;
  if (row.serviced !== null) return `✓ cleaning up ${since(row.serviced)}`;
  return found.holds.some((one) => one.path === row.path) ? `■ ${since(row.preempt)}` : "waits for children";
}
function longest(rows) {
  const leaves = innermost(rows, (row) => row.path);
  const length = (row) => (row.to ?? row.preempt) - row.preempt;
  return leaves.reduce((a5, b3) => length(b3) > length(a5) ? b3 : a5);
}
function titleOf2(row) {
  const after = (t4) => `after ${((t4 - row.preempt) / 1e3).toFixed(3)} s`;
  const lines = [row.path, `asked by ${askerText(row.asked) ?? "?"}`];
  if (row.serviced !== null) lines.push(`serviced ${after(row.serviced)}`);
  if (row.abandoned !== null) lines.push(`abandoned ${after(row.abandoned)}`);
  if (row.to !== null) lines.push(`ended with ${row.outcome ?? "an unknown outcome"} ${after(row.to)}`);
  if (row.asked?.grace != null) lines.push(`abandoned after ${row.asked.grace} s at the latest`);
  return lines.join("\n");
}

// src/panels/reproduction.tsx
var MOST_LINES3 = 6;
var MOST_BARS = 400;
var TICKS = [0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600, 14400];
function ReproduceButtons({ class: name = "" }) {
  if (!canReproduce()) return null;
  const one = reproduction();
  const runs2 = one !== null && !one.found && !one.problem;
  return /* @__PURE__ */ a4("span", { class: `again-buttons ${name}`, children: [
    /* @__PURE__ */ a4(
      "button",
      {
        class: "small",
        disabled: runs2,
        title: "run the recorded mission again: today's code, in virtual time, answered as it was then",
        onClick: () => reproduce("run"),
        children: "Reproduce"
      }
    ),
    /* @__PURE__ */ a4("button", { class: "small", disabled: runs2, title: "write a pytest test of this run", onClick: () => reproduce("test"), children: "Make a test" })
  ] });
}
function ReproductionPanel({ page: page2 }) {
  const one = reproduction();
  if (!one) return null;
  return /* @__PURE__ */ a4(Section, { title: one.what === "test" ? "A test of this run" : "This run with today's code", children: /* @__PURE__ */ a4("div", { class: "again", children: [
    /* @__PURE__ */ a4("span", { class: "again-tools", children: [
      !one.found && !one.problem && /* @__PURE__ */ a4("button", { class: "small", onClick: () => stopReproduction(one.id), children: "Stop" }),
      /* @__PURE__ */ a4("button", { class: "small", "aria-label": "close", onClick: closeReproduction, children: "✕" })
    ] }),
    /* @__PURE__ */ a4("div", { role: "status", children: /* @__PURE__ */ a4(Result, { one, page: page2 }) })
  ] }) });
}
function Result({ one, page: page2 }) {
  if (one.problem) return /* @__PURE__ */ a4("p", { class: "problem", children: shorten(one.problem, 600) });
  const { found } = one;
  if (!found)
    return /* @__PURE__ */ a4("p", { children: [
      /* @__PURE__ */ a4("progress", {}),
      " ",
      one.what === "test" ? "runs it again and again, to leave out what does not matter" : "runs",
      "…"
    ] });
  if (found.kind === "test") return /* @__PURE__ */ a4(WrittenTest, { found });
  if (found.kind === "failed") return /* @__PURE__ */ a4("p", { class: "problem", children: shorten(found.text.join("\n"), 900) });
  const { difference } = found;
  return /* @__PURE__ */ a4($, { children: [
    difference ? /* @__PURE__ */ a4(FirstDifference, { difference, page: page2 }) : /* @__PURE__ */ a4("p", { children: [
      /* @__PURE__ */ a4("span", { class: "pill-text success", children: "✓ the same" }),
      " ",
      found.same,
      " of ",
      found.events,
      " events."
    ] }),
    /* @__PURE__ */ a4(Lines, { title: "Changed", lines: found.changed }),
    /* @__PURE__ */ a4(Lines, { title: "Notes", lines: found.notes }),
    /* @__PURE__ */ a4("p", { class: "again-actions", children: [
      one.now && /* @__PURE__ */ a4(
        "button",
        {
          class: twoRunsShown.value ? "small on" : "small",
          "aria-pressed": twoRunsShown.value,
          onClick: () => {
            twoRunsShown.value = !twoRunsShown.value;
          },
          children: "Both runs"
        }
      ),
      found.machine && /* @__PURE__ */ a4("button", { class: "small", onClick: () => choose(found.machine), children: "Open today's run" })
    ] })
  ] });
}
function FirstDifference({ difference, page: page2 }) {
  const goThere = () => {
    seekDifference();
    page2.goTo(difference.path);
  };
  const at = differenceAt();
  const side = (what, first, next) => /* @__PURE__ */ a4("tr", { children: [
    /* @__PURE__ */ a4("th", { scope: "row", children: what }),
    /* @__PURE__ */ a4("td", { children: [
      /* @__PURE__ */ a4("b", { children: shorten(first, 200) }),
      next.map((line) => /* @__PURE__ */ a4("small", { children: [
        "then ",
        shorten(line, 160)
      ] }))
    ] })
  ] });
  return /* @__PURE__ */ a4($, { children: [
    /* @__PURE__ */ a4("button", { class: "step first-difference", onClick: goThere, children: [
      "First difference ",
      at !== null && /* @__PURE__ */ a4($, { children: [
        "at ",
        store.clock.instantText(at)
      ] }),
      ", event ",
      difference.number
    ] }),
    difference.before.length > 0 && /* @__PURE__ */ a4("p", { class: "hint", children: [
      "the same until ",
      difference.before.map((line) => shorten(line, 120)).join("; ")
    ] }),
    /* @__PURE__ */ a4("table", { class: "two-sides", children: [
      side("recorded", difference.recorded, difference.recorded_next),
      side("today", difference.now, difference.now_next)
    ] })
  ] });
}
function Lines({ title, lines }) {
  if (!lines.length) return null;
  return /* @__PURE__ */ a4($, { children: [
    /* @__PURE__ */ a4("h3", { children: title }),
    /* @__PURE__ */ a4("ul", { class: "again-lines", children: [
      lines.slice(0, MOST_LINES3).map((line) => /* @__PURE__ */ a4("li", { children: shorten(line, 300) })),
      lines.length > MOST_LINES3 && /* @__PURE__ */ a4("li", { children: [
        "and ",
        lines.length - MOST_LINES3,
        " more"
      ] })
    ] })
  ] });
}
function WrittenTest({ found }) {
  const save2 = () => saveFile(new Blob([found.test], { type: "text/x-python" }), found.file);
  const outcomes = store.data.model.value?.root.outcomes ?? [];
  return /* @__PURE__ */ a4($, { children: [
    /* @__PURE__ */ a4("p", { class: "again-actions", children: [
      /* @__PURE__ */ a4("b", { children: found.file }),
      /* @__PURE__ */ a4("button", { class: "small", onClick: () => copyText(found.test), children: "Copy" }),
      /* @__PURE__ */ a4("button", { class: "small", onClick: save2, children: "Save" }),
      /* @__PURE__ */ a4("label", { children: [
        "expects",
        " ",
        /* @__PURE__ */ a4("select", { "aria-label": "what the test expects", onChange: (e4) => reproduce("test", fieldValue(e4)), children: [
          /* @__PURE__ */ a4("option", { value: "", children: "what was recorded, or choose" }),
          outcomes.map((name) => /* @__PURE__ */ a4("option", { value: name, children: name }))
        ] })
      ] })
    ] }),
    /* @__PURE__ */ a4(Lines, { title: "Notes", lines: found.notes }),
    /* @__PURE__ */ a4("pre", { class: "written-test", tabindex: 0, children: found.test })
  ] });
}
function TwoRunsView({ page: page2 }) {
  const one = reproduction();
  const model = store.data.model.value;
  if (!twoRunsShown.value || !one?.now || !one.found || !model) return null;
  return /* @__PURE__ */ a4(OpenTwoRuns, { page: page2, one, found: one.found });
}
function OpenTwoRuns({ page: page2, one, found }) {
  const [aligned2, setAligned] = d2(true);
  const [whole2, setWhole] = d2(false);
  const model = store.data.model.value;
  if (!model || !one.now) return null;
  const { difference } = found;
  const both = twoRuns({ recorded: store.data.run, now: one.now, model }, difference, aligned2);
  const at = difference ? aligned2 ? 0 : difference.at : null;
  const range = whole2 || at === null ? { from: both.from, to: both.to } : around(both, at);
  const choice = (text2, on2, choose2) => /* @__PURE__ */ a4("button", { class: on2 ? "small on" : "small", "aria-pressed": on2, onClick: choose2, children: text2 });
  return /* @__PURE__ */ a4("section", { class: "two-runs", "aria-label": "the recorded run and today's, one under the other", children: [
    /* @__PURE__ */ a4("header", { children: [
      difference && /* @__PURE__ */ a4("span", { class: "group", children: [
        choice("from the difference", aligned2, () => setAligned(true)),
        choice("from the begin", !aligned2, () => setAligned(false))
      ] }),
      difference && choice("whole", whole2, () => setWhole(!whole2)),
      /* @__PURE__ */ a4("span", { class: "hint", children: difference ? `the same up to the line: ${found.same} events` : "the same throughout" }),
      /* @__PURE__ */ a4("span", { class: "spread" }),
      choice("One run", false, () => {
        twoRunsShown.value = false;
      })
    ] }),
    /* @__PURE__ */ a4(Side, { title: "recorded", lanes: both.recorded, range, at, children: (bar) => {
      store.playback.seek(bar.at);
      page2.goTo(bar.path);
    } }),
    /* @__PURE__ */ a4(Side, { title: "today", lanes: both.now, range, at, children: (bar) => page2.goTo(bar.path) }),
    /* @__PURE__ */ a4(Axis2, { range, relative: aligned2 && difference !== null })
  ] });
}
var percent = (t4, { from, to }) => 100 * (t4 - from) / Math.max(1e-6, to - from);
function Side({
  title,
  lanes,
  range,
  at,
  children: pick
}) {
  const seen2 = (bar) => bar.to >= range.from && bar.from <= range.to;
  return /* @__PURE__ */ a4("div", { class: "side", role: "group", "aria-label": title, children: [
    /* @__PURE__ */ a4("h3", { children: title }),
    lanes.map((lane) => /* @__PURE__ */ a4("div", { class: "lane", children: [
      /* @__PURE__ */ a4("span", { title: lane.path, children: shorten(lane.name, 40) }),
      /* @__PURE__ */ a4("div", { class: "bars", children: lane.bars.filter(seen2).slice(0, MOST_BARS).map((bar) => /* @__PURE__ */ a4(BarButton, { bar, range, at, onPick: () => pick(bar) })) })
    ] }, lane.path)),
    at !== null && /* @__PURE__ */ a4("div", { class: "difference-line", children: /* @__PURE__ */ a4("i", { style: { left: `${percent(at, range)}%` } }) })
  ] });
}
function BarButton({ bar, range, at, onPick }) {
  const left = Math.max(0, percent(bar.from, range));
  const wide = Math.min(100, percent(bar.to, range)) - left;
  const took = duration(bar.to - bar.from);
  const isBefore = at !== null && !bar.differs && bar.to < at;
  return /* @__PURE__ */ a4(
    "button",
    {
      class: `bar ${bar.kind} ${bar.differs ? "differs" : ""} ${isBefore ? "before" : ""}`,
      style: { left: `${left}%`, width: `${wide}%` },
      title: `${bar.path}: ${took}${bar.differs ? ", here the runs differ" : ""}`,
      onClick: onPick,
      children: [
        bar.name,
        " ",
        took
      ]
    }
  );
}
function Axis2({ range, relative }) {
  const step = TICKS.find((one) => (range.to - range.from) / one <= 8) ?? 86400;
  const ticks2 = [];
  for (let t4 = Math.ceil(range.from / step) * step; t4 <= range.to; t4 += step)
    ticks2.push(
      /* @__PURE__ */ a4("span", { style: { left: `${percent(t4, range)}%` }, children: relative ? `${t4 > 0 ? "+" : ""}${Number(t4.toFixed(1))} s` : store.clock.runText(1e3 * t4, step < 1 ? 1 : 0, 0) })
    );
  return /* @__PURE__ */ a4("div", { class: "lane axis", "aria-hidden": "true", children: [
    /* @__PURE__ */ a4("span", {}),
    /* @__PURE__ */ a4("div", { class: "bars", children: ticks2 })
  ] });
}

// src/panels/selected_state.tsx
function SelectedState({ data, now, model }) {
  const node = model.get(store.view.selected.value);
  if (!node) return null;
  const state = own(data.states, node.path);
  return /* @__PURE__ */ a4(Section, { title: node.name, children: [
    /* @__PURE__ */ a4(StateControls, { node, state }, node.path),
    node.doc && /* @__PURE__ */ a4("p", { class: "doc", children: node.doc }),
    /* @__PURE__ */ a4("dl", { class: "facts", children: [
      factsOf(node, state, now).map(([name, value]) => /* @__PURE__ */ a4($, { children: [
        /* @__PURE__ */ a4("dt", { children: name }),
        /* @__PURE__ */ a4("dd", { children: value })
      ] })),
      /* @__PURE__ */ a4(Keys, { keys: model.keys[node.path] })
    ] }),
    state?.error && /* @__PURE__ */ a4("p", { class: "error", children: shorten(state.error, 2e3) }),
    /* @__PURE__ */ a4("ul", { class: "outcomes", children: node.outcomes.map((outcome) => /* @__PURE__ */ a4(Outcome, { node, outcome, times: own(state?.outcomes, outcome), model })) })
  ] });
}
function factsOf(node, state, now) {
  const running = state?.since != null ? (now - state.since / 1e6) / 1e3 : null;
  const recorded = own(store.data.statistics.value?.states, node.path);
  const facts = [
    ["kind", `${KIND_NAMES[node.kind] ?? node.kind} (${node.type_name})`],
    ...node.details
  ];
  facts.push(["visits", state?.visits ?? 0]);
  if (state?.visits) facts.push(["time inside", duration(state.seconds + (running ?? 0))]);
  if (running !== null) facts.push(["running for", duration(running)]);
  if (state?.attempt && state.attempt > 1) facts.push(["attempt", state.attempt]);
  if (recorded) facts.push(["recorded runs", recordedText(recorded)]);
  return facts;
}
function recordedText({ median, p95, failures, visits }) {
  const times = `median ${duration(median ?? 0)}, 95 % under ${duration(p95 ?? 0)}`;
  return `${times}, ${Math.round(failures * 100)} % failed of ${visits}`;
}
function Keys({ keys: keys2 }) {
  if (!keys2) return null;
  const outside = new Map(keys2.remapping);
  const key = (name) => {
    const other = outside.get(name);
    return /* @__PURE__ */ a4($, { children: [
      /* @__PURE__ */ a4("code", { children: [
        name,
        other !== void 0 && other !== name ? ` ← ${other}` : ""
      ] }),
      " "
    ] });
  };
  return /* @__PURE__ */ a4($, { children: [
    keys2.inputs.length > 0 && /* @__PURE__ */ a4($, { children: [
      /* @__PURE__ */ a4("dt", { children: "reads" }),
      /* @__PURE__ */ a4("dd", { children: keys2.inputs.map(key) })
    ] }),
    keys2.outputs.length > 0 && /* @__PURE__ */ a4($, { children: [
      /* @__PURE__ */ a4("dt", { children: "writes" }),
      /* @__PURE__ */ a4("dd", { children: keys2.outputs.map(key) })
    ] })
  ] });
}
function Outcome({
  node,
  outcome,
  times,
  model
}) {
  const link2 = model.linkOf(node, outcome);
  return /* @__PURE__ */ a4("li", { children: [
    /* @__PURE__ */ a4(OutcomeBreakpoint, { node, outcome }),
    /* @__PURE__ */ a4(Pill, { kind: endClass(node, outcome), children: shorten(outcome, 60) }),
    /* @__PURE__ */ a4("span", { children: link2 ? ` → ${shorten(link2.target)}` : "" }),
    /* @__PURE__ */ a4("span", { class: "times", children: times ? `×${times}` : "" })
  ] });
}

// src/panels/userdata.tsx
var FRESH_MS = 900;
var MOST_VALUES = 60;
var MOST_CHANGES = 8;
var SHORT = 160;
var CHANGE = 60;
var MOST_ITEMS2 = 100;
var LONGEST2 = 2e3;
var RUNS = 1e20;
function Userdata({ page: page2, data, now }) {
  const [open, setOpen] = d2(null);
  const [most, setMost] = d2(MOST_VALUES);
  const entries = sorted(data);
  const several = new Set(entries.map(([, entry]) => entry.container)).size > 1;
  const rows = entries.slice(0, most).map(([id, entry], i4) => {
    const isFirst = several && entries[i4 - 1]?.[1].container !== entry.container;
    const onClick = () => setOpen(open === id ? null : id);
    return /* @__PURE__ */ a4($, { children: [
      isFirst && /* @__PURE__ */ a4(ContainerRow, { path: entry.container }),
      /* @__PURE__ */ a4(Row3, { entry, open: open === id, onClick, now, page: page2 }, id)
    ] });
  });
  return /* @__PURE__ */ a4(Section, { title: "Userdata", count: entries.length || null, children: [
    !entries.length && /* @__PURE__ */ a4("p", { class: "hint", children: "nothing written yet" }),
    /* @__PURE__ */ a4("div", { class: "scroller", children: /* @__PURE__ */ a4("table", { class: "userdata", children: /* @__PURE__ */ a4("tbody", { children: rows }) }) }),
    /* @__PURE__ */ a4(More, { left: entries.length - most, onMore: () => setMost(most + 4 * MOST_VALUES) })
  ] });
}
function sorted(data) {
  const rank = /* @__PURE__ */ new Map();
  for (const { container, at } of Object.values(data.userdata)) {
    const runs2 = own(data.states, container)?.since != null;
    rank.set(container, Math.max(rank.get(container) ?? 0, runs2 ? RUNS : at));
  }
  return Object.entries(data.userdata).sort(
    ([a5, one], [b3, other]) => rank.get(other.container) - rank.get(one.container) || (a5 < b3 ? -1 : 1)
  );
}
function ContainerRow({ path }) {
  const names = path.split("/").filter(Boolean).slice(-2);
  const title = names.map((name) => shorten(name)).join(" › ");
  return /* @__PURE__ */ a4("tr", { class: "group", children: /* @__PURE__ */ a4("th", { colspan: 2, title: path, children: title }) });
}
function Row3({
  entry,
  open,
  onClick,
  now,
  page: page2
}) {
  const text2 = brief(entry.value);
  const short = text2.length > SHORT ? `${text2.slice(0, SHORT)}…` : text2;
  const isFresh = now - entry.at / 1e6 < FRESH_MS;
  return /* @__PURE__ */ a4("tr", { class: isFresh ? "fresh" : "", onClick, children: [
    /* @__PURE__ */ a4("th", { scope: "row", title: shorten(entry.container, 400), children: /* @__PURE__ */ a4("button", { class: "key", "aria-expanded": open, children: shorten(entry.key, 80) }) }),
    /* @__PURE__ */ a4("td", { children: [
      /* @__PURE__ */ a4("code", { children: open ? /* @__PURE__ */ a4(Whole, { value: entry.value }) : short }),
      open && wasShortened(entry.value) && /* @__PURE__ */ a4(WholeValue, { entry }),
      /* @__PURE__ */ a4("small", { children: [
        "by ",
        /* @__PURE__ */ a4(StateLink, { path: entry.writer, page: page2 }),
        " at ",
        store.clock.instantText(entry.at / 1e6, 2)
      ] })
    ] })
  ] });
}
function Whole({ value }) {
  const branch = branchOf(value);
  if (typeof branch === "string") return /* @__PURE__ */ a4("pre", { children: branch.slice(0, LONGEST2) });
  const item = ([name, part]) => {
    const inner = branchOf(part);
    return /* @__PURE__ */ a4("li", { children: [
      name !== null && /* @__PURE__ */ a4("b", { children: shorten(name, 80) }),
      " ",
      typeof inner === "string" ? inner.slice(0, LONGEST2) : /* @__PURE__ */ a4(Whole, { value: part })
    ] });
  };
  const left = branch.parts.length - MOST_ITEMS2;
  return /* @__PURE__ */ a4($, { children: [
    /* @__PURE__ */ a4("span", { children: branch.name }),
    /* @__PURE__ */ a4("ul", { class: "value-tree", children: [
      branch.parts.slice(0, MOST_ITEMS2).map(item),
      left > 0 && /* @__PURE__ */ a4("li", { children: [
        "and ",
        left,
        " more"
      ] })
    ] })
  ] });
}
var wholeValues = y3({});
function WholeValue({ entry }) {
  const container = store.data.model.value?.get(entry.writer)?.parent?.path ?? entry.container;
  const id = `${store.data.facts.value?.epoch} ${container} ${entry.key}`;
  const found = wholeValues.value[id];
  if (isFile() || store.data.facts.value?.recorded) return /* @__PURE__ */ a4("small", { children: "shortened when it was recorded" });
  const put2 = (answer) => {
    wholeValues.value = { ...wholeValues.value, [id]: answer };
  };
  const fetchIt = async (e4) => {
    e4.stopPropagation();
    put2({ text: "Asking the mission…" });
    put2(
      await ask(link("value", `&container=${encoded(container)}&key=${encoded(entry.key)}`))
    );
  };
  if (!found)
    return /* @__PURE__ */ a4("button", { class: "small whole", onClick: fetchIt, children: "Fetch the whole value" });
  const text2 = found.text ?? "";
  return /* @__PURE__ */ a4("div", { class: "whole-value", onClick: (e4) => e4.stopPropagation(), children: found.ok ? /* @__PURE__ */ a4($, { children: [
    /* @__PURE__ */ a4("small", { children: [
      "as it was when it was asked for, ",
      text2.length.toLocaleString("en"),
      " characters",
      " ",
      /* @__PURE__ */ a4("button", { class: "small", onClick: fetchIt, children: "again" })
    ] }),
    /* @__PURE__ */ a4("textarea", { readonly: true, rows: 14, wrap: "off", "aria-label": `the whole value of ${entry.key}`, value: text2 })
  ] }) : /* @__PURE__ */ a4("p", { class: "error", children: text2 }) });
}
function Changes({ page: page2 }) {
  const [whole2, setWhole] = d2(false);
  if (store.playback.cursor.value === null) return null;
  const { before, writes } = store.data.run.lastTransition(store.playback.eventsShown());
  const shown = whole2 ? writes : writes.slice(-MOST_CHANGES);
  return /* @__PURE__ */ a4(Section, { title: "Changed by this transition", children: [
    !writes.length && /* @__PURE__ */ a4("p", { class: "hint", children: "no userdata was written" }),
    shown.map((e4) => {
      const was = own(before.userdata, `${containerOf(e4.path)} ${e4.key}`);
      return /* @__PURE__ */ a4("div", { class: "diff", children: [
        /* @__PURE__ */ a4("b", { children: e4.key }),
        " ",
        /* @__PURE__ */ a4("del", { children: was ? brief(was.value).slice(0, CHANGE) : "unset" }),
        " ",
        /* @__PURE__ */ a4("ins", { children: brief(e4.value).slice(0, CHANGE) }),
        " ",
        /* @__PURE__ */ a4("small", { children: [
          "by ",
          /* @__PURE__ */ a4(StateLink, { path: e4.path, page: page2 })
        ] })
      ] });
    }),
    /* @__PURE__ */ a4(More, { left: writes.length - shown.length, onMore: () => setWhole(true) })
  ] });
}

// src/drawing/card.ts
var WIDTH2 = 800;
var EDGE = 24;
var LINE = 24;
var MOST_STEPS = 6;
var FONTS_MS2 = 150;
async function copyCard(page2, why) {
  try {
    const canvas2 = await draw2(page2, why);
    const blob = await new Promise((done) => canvas2.toBlob(done, "image/png"));
    if (!blob) throw new Error("this browser makes no picture of it");
    try {
      await navigator.clipboard.write([new ClipboardItem({ "image/png": blob })]);
      store.view.notify("Copied");
    } catch {
      saveFile(blob, `${page2.fileName()}.png`);
    }
  } catch (error) {
    store.view.notify(`No card: ${messageOf(error)}`, "error");
  }
}
async function draw2(page2, why) {
  const { svg: svg2 } = page2.diagram;
  const floor3 = page2.map.canvas;
  const style = await styleText();
  await pictureOf(svg2, style);
  await new Promise((done) => setTimeout(done, FONTS_MS2));
  const diagram = await pictureOf(svg2, style);
  const wide = WIDTH2 - 2 * EDGE;
  const tall = (from) => from.clientWidth ? Math.round(from.clientHeight * wide / from.clientWidth) : 0;
  const steps = why.steps.slice(0, MOST_STEPS);
  const lines = steps.reduce((sum, { reason }) => sum + (reason ? 2 : 1), 0);
  const heights = { diagram: tall(svg2), map: tall(floor3) };
  const height = EDGE * 3 + LINE * (lines + 3) + heights.diagram + heights.map;
  const canvas2 = document.createElement("canvas");
  const ratio = 2;
  Object.assign(canvas2, { width: WIDTH2 * ratio, height: height * ratio });
  const g5 = canvas2.getContext("2d");
  g5.scale(ratio, ratio);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`);
  const write2 = (text2, x3, y6, font2, ink, most = WIDTH2 - EDGE - x3) => {
    g5.font = font2;
    g5.fillStyle = colour(ink);
    let shown = text2;
    while (shown.length > 4 && g5.measureText(shown).width > most) shown = `${shown.slice(0, -2).trimEnd()}…`;
    g5.fillText(shown, x3, y6);
  };
  g5.fillStyle = colour("background");
  g5.fillRect(0, 0, WIDTH2, height);
  g5.textBaseline = "middle";
  let y5 = EDGE + LINE / 2;
  const outcome = why.outcome ?? "no end";
  write2(`${page2.title()}: ${outcome}`, EDGE, y5, "680 18px Inter, Arial, sans-serif", "ink");
  y5 += LINE * 1.5;
  for (const step of steps) {
    const t4 = store.clock.runText(step.stamp_ns / 1e6, 1);
    write2(t4, EDGE, y5, "600 12px 'JetBrains Mono', monospace", "muted");
    const text2 = `${store.data.nameOf(step.path)} ${shorten(step.what, 120)}`;
    write2(text2, EDGE + 80, y5, "620 13px Inter, Arial, sans-serif", step.kind === "failure" ? "failure-text" : "ink");
    y5 += LINE;
    if (!step.reason) continue;
    write2(shorten(step.reason, 160), EDGE + 80, y5 - 4, "12px Inter, Arial, sans-serif", "muted");
    y5 += LINE;
  }
  g5.drawImage(diagram, EDGE, y5, wide, heights.diagram);
  y5 += heights.diagram + EDGE / 2;
  if (heights.map) g5.drawImage(floor3, EDGE, y5, wide, heights.map);
  const began = why.began === null ? "" : new Date(why.began / 1e6).toISOString().slice(0, 16).replace("T", " ");
  const about = `${store.data.facts.value?.name ?? ""}, began ${began}, made with smachpy`;
  write2(about, EDGE, height - EDGE, FONT, "muted");
  return canvas2;
}

// src/core/good_runs.ts
var MIDDLE = 0.8;
function placed2({ good, number }) {
  if (number === null || !good.length) return null;
  const sorted2 = [...good].sort((a5, b3) => a5 - b3);
  const [least, most] = [Math.min(sorted2[0], number), Math.max(sorted2[sorted2.length - 1], number)];
  const margin = (most - least || Math.abs(most) || 1) * 0.08;
  const [low, high] = [least - margin, most + margin];
  const x3 = (value) => (value - low) / (high - low);
  const at = (share) => sorted2[Math.round(share * (sorted2.length - 1))];
  const rest = (1 - MIDDLE) / 2;
  return { low: least, high: most, dots: sorted2.map(x3), box: [x3(at(rest)), x3(at(1 - rest))], here: x3(number) };
}

// src/panels/good_runs.tsx
var MOST_FACTS = 8;
function GoodRunsPart() {
  const [found, setFound] = d2(null);
  A2(() => {
    let open = !isFile();
    const read = async () => {
      const answer = await ask(link("good"));
      if (open && !isFailure(answer)) setFound(answer);
    };
    if (open) read();
    return () => {
      open = false;
    };
  }, []);
  if (!found?.path || !found.runs) return null;
  const facts = [...found.facts].sort((a5, b3) => Number(b3.differs) - Number(a5.differs));
  return /* @__PURE__ */ a4("div", { class: "good-runs", children: [
    /* @__PURE__ */ a4("h3", { children: [
      store.data.nameOf(found.path),
      " in ",
      found.runs,
      " good run",
      found.runs === 1 ? "" : "s"
    ] }),
    /* @__PURE__ */ a4("p", { class: facts.some(({ differs }) => differs) ? "conclusion" : "hint", children: shorten(found.text, 400) }),
    facts.slice(0, MOST_FACTS).map((fact) => /* @__PURE__ */ a4(FactLine, { fact }, fact.name))
  ] });
}
function FactLine({ fact }) {
  const line = placed2(fact);
  const text2 = (value) => `${Number(value.toPrecision(3))}${fact.unit && ` ${fact.unit}`}`;
  const goodText = `${text2(Math.min(...fact.good))} to ${text2(Math.max(...fact.good))}`;
  return /* @__PURE__ */ a4("div", { class: fact.differs ? "fact differs" : "fact", children: [
    /* @__PURE__ */ a4("span", { children: [
      /* @__PURE__ */ a4("b", { children: shorten(fact.name, 30) }),
      " here ",
      /* @__PURE__ */ a4("b", { class: "here", children: shorten(fact.here, 60) })
    ] }),
    line ? /* @__PURE__ */ a4($, { children: [
      /* @__PURE__ */ a4("svg", { role: "img", "aria-label": `good runs ${goodText}, here ${fact.here}`, children: [
        /* @__PURE__ */ a4("line", { x1: "0", x2: "100%", y1: "10", y2: "10" }),
        /* @__PURE__ */ a4(
          "rect",
          {
            x: `${100 * line.box[0]}%`,
            width: `${100 * Math.max(4e-3, line.box[1] - line.box[0])}%`,
            y: "3",
            height: "14",
            rx: "3"
          }
        ),
        line.dots.map((x3) => /* @__PURE__ */ a4("circle", { cx: `${100 * x3}%`, cy: "10", r: "2.5" })),
        /* @__PURE__ */ a4("text", { x: `${100 * line.here}%`, y: "10.5", children: "◆" })
      ] }),
      /* @__PURE__ */ a4("small", { children: [
        /* @__PURE__ */ a4("span", { children: text2(line.low) }),
        /* @__PURE__ */ a4("span", { children: text2(line.high) })
      ] })
    ] }) : /* @__PURE__ */ a4("small", { children: [
      "good: ",
      fact.texts.map((one) => shorten(one, 40)).join(", ")
    ] })
  ] });
}

// src/panels/why.tsx
function WhyPanel({ page: page2 }) {
  const why = store.data.why.value;
  if (!why) return null;
  const title = why.outcome === null ? "Why has it no end?" : "Why did it end so?";
  return /* @__PURE__ */ a4(Section, { title, children: /* @__PURE__ */ a4("div", { class: "why", children: [
    /* @__PURE__ */ a4("span", { class: "why-tools", children: [
      /* @__PURE__ */ a4("button", { class: "small", onClick: () => copyText(why.text), children: "Copy as text" }),
      /* @__PURE__ */ a4(
        "button",
        {
          class: "small",
          title: "a picture of the causes, the diagram and the map",
          onClick: () => copyCard(page2, why),
          children: "Copy as card"
        }
      ),
      /* @__PURE__ */ a4("button", { class: "small", "aria-label": "close", onClick: () => showWhy(false), children: "✕" })
    ] }),
    !why.steps.length && /* @__PURE__ */ a4("p", { class: "hint", children: "the causes are unknown" }),
    /* @__PURE__ */ a4("ol", { children: why.steps.map((step, i4) => /* @__PURE__ */ a4(Step, { step, first: i4 === 0, page: page2 })) }),
    /* @__PURE__ */ a4(GoodRunsPart, {}, `${why.label} ${why.ended}`)
  ] }) });
}
function Step({ step, first, page: page2 }) {
  const goThere = () => {
    store.playback.seek(step.stamp_ns / 1e6);
    page2.goTo(step.path);
  };
  return /* @__PURE__ */ a4("li", { class: `${step.kind} ${first ? "first" : ""}`, children: [
    /* @__PURE__ */ a4("button", { class: "step", title: step.path, onClick: goThere, children: [
      /* @__PURE__ */ a4("b", { children: store.data.nameOf(step.path) }),
      " ",
      /* @__PURE__ */ a4("span", { class: `word ${step.kind}`, children: step.what }),
      " ",
      /* @__PURE__ */ a4("time", { children: store.clock.instantText(step.stamp_ns / 1e6, 2) })
    ] }),
    step.reason && /* @__PURE__ */ a4("p", { children: step.reason }),
    step.detail && /* @__PURE__ */ a4("pre", { children: step.detail }),
    step.read.map(([key, value, writer, stamp]) => /* @__PURE__ */ a4("p", { children: [
      "read ",
      /* @__PURE__ */ a4("b", { children: key }),
      " ",
      value,
      " ",
      /* @__PURE__ */ a4("small", { children: "of" }),
      " ",
      /* @__PURE__ */ a4(StateLink, { path: writer, page: page2 }),
      " ",
      /* @__PURE__ */ a4("small", { children: store.clock.instantText(stamp / 1e6, 2) })
    ] })),
    step.written.map(([key, value, before]) => /* @__PURE__ */ a4("p", { children: [
      "wrote ",
      /* @__PURE__ */ a4("b", { children: key }),
      " ",
      value,
      " ",
      before && /* @__PURE__ */ a4("small", { children: [
        "(was ",
        before,
        ")"
      ] })
    ] }))
  ] });
}

// src/panels/inspector.tsx
var MOST_PROBLEMS = 30;
function Inspector({ page: page2 }) {
  store.playback.watchSlowly();
  const model = store.data.model.value;
  if (!model) return /* @__PURE__ */ a4("aside", { class: "inspector" });
  const shared = { page: page2, data: store.playback.shown(), now: store.playback.nowMs() };
  return /* @__PURE__ */ a4("aside", { class: "inspector", "aria-label": "details", children: [
    /* @__PURE__ */ a4(MissingEvents, { dropped: shared.data.dropped ?? 0 }),
    /* @__PURE__ */ a4(ReproductionPanel, { page: page2 }),
    /* @__PURE__ */ a4(WhyPanel, { page: page2 }),
    /* @__PURE__ */ a4(SelectedState, { ...shared, model }),
    /* @__PURE__ */ a4(Differences, { page: page2 }),
    /* @__PURE__ */ a4(Preempts, { ...shared }),
    /* @__PURE__ */ a4(Notes2, {}),
    /* @__PURE__ */ a4(Goals, { ...shared }),
    /* @__PURE__ */ a4(Userdata, { ...shared }),
    /* @__PURE__ */ a4(Changes, { page: page2 }),
    /* @__PURE__ */ a4(Numbers, {}),
    /* @__PURE__ */ a4(Problems, { page: page2 }),
    /* @__PURE__ */ a4(Log, { page: page2 })
  ] });
}
function MissingEvents({ dropped: dropped2 }) {
  const gap = store.data.gap.value;
  return /* @__PURE__ */ a4($, { children: [
    gap !== null && /* @__PURE__ */ a4("p", { class: "hint gap", role: "status", children: [
      "This page missed ",
      countOfEvents(gap),
      ". They and all before them are counted, but not in the timeline."
    ] }),
    dropped2 > 0 && /* @__PURE__ */ a4("p", { class: "hint gap", role: "status", children: [
      "Events came faster than they could be sent: ",
      countOfEvents(dropped2),
      " are missing, so all counts are too low."
    ] })
  ] });
}
function Problems({ page: page2 }) {
  const found = store.data.problems.value;
  if (!found.length) return null;
  const text2 = (one) => shorten(one.text.startsWith(`${one.path}: `) ? one.text.slice(one.path.length + 2) : one.text, 600);
  return /* @__PURE__ */ a4("section", { children: /* @__PURE__ */ a4("details", { class: "fold-up", children: [
    /* @__PURE__ */ a4("summary", { children: /* @__PURE__ */ a4("h2", { children: [
      "Problems of the machine ",
      /* @__PURE__ */ a4("span", { class: "number", children: found.length })
    ] }) }),
    /* @__PURE__ */ a4("ul", { class: "problems", children: found.slice(0, MOST_PROBLEMS).map((one) => /* @__PURE__ */ a4("li", { class: one.severity, children: [
      /* @__PURE__ */ a4(StateLink, { path: one.path, page: page2 }),
      " ",
      text2(one)
    ] })) })
  ] }) });
}

// src/panels/map.tsx
var NO_MAP = "No map: a grid of 1 m. Name a file with --map, or publish the topic map.";
var MOST_ROBOTS = 2;
function MapPanel({ page: page2, children }) {
  store.playback.watch();
  const { map } = page2;
  const names = [...store.data.scene.robots].filter(([, robot]) => robot.poses.length).map(([name]) => name).sort();
  const noMap = !store.data.scene.maps.length;
  return /* @__PURE__ */ a4("section", { class: "map-panel", "aria-label": "map", children: [
    /* @__PURE__ */ a4("header", { children: [
      /* @__PURE__ */ a4("h2", { children: "Map" }),
      noMap && /* @__PURE__ */ a4("span", { class: "hint", title: NO_MAP, children: "No map: try --map FILE" }),
      /* @__PURE__ */ a4("span", { class: "spread" }),
      /* @__PURE__ */ a4(Choice2, { map, names })
    ] }),
    /* @__PURE__ */ a4("div", { class: "map-view", children: [
      children,
      /* @__PURE__ */ a4(Tip, {})
    ] })
  ] });
}
function Choice2({ map, names }) {
  if (names.length > MOST_ROBOTS)
    return /* @__PURE__ */ a4(
      "select",
      {
        class: "small",
        "aria-label": "robot in the middle",
        value: map.followed === null ? -1 : names.indexOf(map.followed),
        onChange: (e4) => map.show(names[Number(e4.currentTarget.value)] ?? null),
        children: [
          /* @__PURE__ */ a4("option", { value: -1, children: "Whole" }),
          names.map((name, i4) => /* @__PURE__ */ a4("option", { value: i4, children: shorten(name || "Robot", 40) }))
        ]
      }
    );
  return /* @__PURE__ */ a4("span", { class: "group", children: [
    /* @__PURE__ */ a4(
      "button",
      {
        class: map.followed === null ? "on small" : "small",
        title: "the whole map (double-click)",
        onClick: () => map.show(null),
        children: "Whole"
      }
    ),
    names.map((name) => /* @__PURE__ */ a4(
      "button",
      {
        class: map.followed === name ? "on small" : "small",
        title: "keep it in the middle",
        onClick: () => map.show(name),
        children: shorten(name || "Robot", 16)
      }
    ))
  ] });
}
function Tip() {
  const visit = store.pointer.hovered.value;
  if (!visit) return null;
  const goal = store.data.scene.goalOf(visit.path, visit.from);
  const span = store.data.run.spans.findLast((one) => one.path === visit.path && one.from === visit.from);
  const to = span?.to ?? null;
  const place = goal ? store.data.scene.placeName(goal) : "";
  const times = [visit.from, to].map((t4) => t4 === null ? "now" : store.clock.instantText(t4)).join(" – ");
  const took = ((to ?? store.playback.nowMs()) - visit.from) / 1e3;
  const title = store.data.nameOf(visit.path) + (place && ` → ${shorten(place, 30)}`);
  return /* @__PURE__ */ a4("div", { class: "tip", role: "status", children: [
    /* @__PURE__ */ a4("b", { children: title }),
    /* @__PURE__ */ a4("span", { children: [
      span?.outcome ? shorten(span.outcome, 30) : "runs",
      " ",
      times,
      ", ",
      took.toFixed(1),
      " s"
    ] })
  ] });
}

// src/panels/messages.tsx
var MOST_NAMES3 = 12;
var MOST_HOLDS = 3;
var LEGEND = [
  ["active", "running"],
  ["success", "succeeded"],
  ["failure", "failed"],
  ["preempted", "preempted"],
  ["waiting", "waiting"]
];
var KEYS2 = [
  ["Ctrl+K", "find or do by name"],
  ["/", "search"],
  ["c", "instants by the run, by the wall clock, or relative to now"],
  ["0", "fit everything"],
  ["f p g k", "next failure, preempt, goal, change of a key; with Shift the previous one"],
  ["Home End", "the beginning, the end"],
  ["m", "the map: + − zoom, 0 shows all"],
  ["o", "follow the running states"],
  ["+ −", "zoom"],
  ["← ↑ → ↓", "move the view, or select a neighbour of the selected state"],
  ["Enter", "open or close the selected state"],
  [", .", "one event back or forward"],
  ["l", "return to live"],
  ["1 … 9", "levels to open"],
  ["r [ ]", "loop over the selected stretch of the run; move its beginning or end to the instant shown"],
  ["w", "the causes of the run's end"],
  ["n", "note at the instant shown"],
  ["t", "states, on a small screen"],
  ["i", "implicit transitions"],
  ["a", "actions"],
  ["h", "runs"],
  ["d", "dark or light"],
  ["Space", "play or pause the view; pause or resume the mission (with control)"],
  ["s", "step (with control)"],
  ["Esc", "clear the selection"]
];
function Overlay({ page: page2 }) {
  const stale = store.data.facts.value?.stale;
  if (store.data.failure.value && store.data.model.value)
    return /* @__PURE__ */ a4("div", { class: "banner waiting", children: store.data.failure.value });
  if (store.data.failure.value)
    return /* @__PURE__ */ a4("div", { class: "empty", children: /* @__PURE__ */ a4("p", { class: "error", children: store.data.failure.value }) });
  if (!store.data.model.value) return /* @__PURE__ */ a4(Empty, {});
  if (store.status.runStatus.value.word === "stale" && stale != null)
    return /* @__PURE__ */ a4("div", { class: "banner waiting", children: [
      "Stale: no message from this machine since ",
      new Date(stale / 1e6).toLocaleTimeString("en-GB"),
      ". You see its last known state."
    ] });
  if (store.data.connection.value === "lost")
    return /* @__PURE__ */ a4("div", { class: "banner waiting", children: [
      store.data.problem.value || "The viewer's server does not answer.",
      " You see the last known state; this page keeps trying."
    ] });
  if (store.playback.cursor.value !== null) {
    const isOver = store.data.facts.value?.recorded || isFile();
    const ago = ((store.data.run.last() ?? store.playback.cursor.value) - store.playback.cursor.value) / 1e3;
    const when = isOver ? "before the end" : "ago";
    return /* @__PURE__ */ a4("div", { class: "banner past", children: [
      "Viewing ",
      /* @__PURE__ */ a4("b", { children: store.clock.instantText(store.playback.cursor.value) }),
      /* @__PURE__ */ a4("span", { class: "ago", children: [
        ", ",
        duration(ago),
        " ",
        when
      ] }),
      /* @__PURE__ */ a4("button", { onClick: () => page2.timeline.live(), children: [
        "Back to ",
        isOver ? "the end" : "live"
      ] })
    ] });
  }
  const after = store.data.facts.value?.after;
  if (after)
    return /* @__PURE__ */ a4("div", { class: "banner other", children: [
      "You see an earlier run.",
      /* @__PURE__ */ a4("button", { onClick: () => choose(after), children: "Show the newest" })
    ] });
  return /* @__PURE__ */ a4(PreemptBanner, { page: page2 });
}
function RestartBanner({ before }) {
  const dismiss = () => {
    store.view.dismissed.value = before;
  };
  return /* @__PURE__ */ a4("div", { class: "banner other restarted", role: "status", children: [
    "A new run began.",
    /* @__PURE__ */ a4("button", { onClick: () => choose(before), children: "Look at the one before" }),
    /* @__PURE__ */ a4("button", { "aria-label": "dismiss", onClick: dismiss, children: "✕" })
  ] });
}
function PreemptBanner({ page: page2 }) {
  store.playback.watch();
  const now = store.playback.nowMs();
  const found = store.data.run.now.ended == null ? store.data.run.preemptAt(now) : null;
  const before = store.data.facts.value?.before;
  if (!found || found.to !== null)
    return before && store.view.dismissed.value !== before ? /* @__PURE__ */ a4(RestartBanner, { before }) : null;
  const by = askerText(found.rows[0].asked);
  const more = found.holds.length - MOST_HOLDS;
  return /* @__PURE__ */ a4("div", { class: "banner preempted preempt-banner", role: "status", children: [
    /* @__PURE__ */ a4("span", { children: [
      "Preempt",
      by ? /* @__PURE__ */ a4($, { children: [
        " ",
        "by ",
        /* @__PURE__ */ a4("b", { children: by })
      ] }) : "",
      ". Held up by",
      " "
    ] }),
    found.holds.slice(0, MOST_HOLDS).map((row, i4) => /* @__PURE__ */ a4($, { children: [
      i4 > 0 ? ", " : "",
      /* @__PURE__ */ a4(StateLink, { path: row.path, page: page2 }),
      /* @__PURE__ */ a4("span", { class: "times", children: [
        " for ",
        holdText(row, now)
      ] })
    ] })),
    more > 0 ? ` and ${more} more` : ""
  ] });
}
function Empty() {
  const name = store.data.wanted.value;
  const list = store.data.machines.value;
  if (store.data.connection.value === "lost")
    return /* @__PURE__ */ a4("div", { class: "empty", children: /* @__PURE__ */ a4("p", { children: [
      store.data.problem.value || "The viewer's server does not answer.",
      " This page keeps trying."
    ] }) });
  if (!store.data.isMissing.value) return null;
  const text2 = name ? `No machine is called “${shorten(name, 80)}”.` : "No machine on the network yet.";
  const others = list.slice(0, MOST_NAMES3);
  const more = list.length - others.length;
  const button = (one) => /* @__PURE__ */ a4("button", { onClick: () => choose(one.name), children: shorten(one.name, 60) });
  return /* @__PURE__ */ a4("div", { class: "empty", children: [
    /* @__PURE__ */ a4("p", { children: [
      text2,
      " This page shows it as soon as it runs."
    ] }),
    list.length ? /* @__PURE__ */ a4($, { children: [
      /* @__PURE__ */ a4("p", { children: "These are there:" }),
      /* @__PURE__ */ a4("p", { class: "others", children: [
        others.map(button),
        more > 0 && `and ${more} more, in the list above`
      ] })
    ] }) : /* @__PURE__ */ a4("pre", { children: "smachpy run patrol --start-robot" })
  ] });
}
function Laying() {
  const laid = store.view.laidOut.value;
  if (!laid) return null;
  const { done, all } = laid;
  const text2 = `${done.toLocaleString("en")} of ${all.toLocaleString("en")} states`;
  return /* @__PURE__ */ a4("div", { class: "laying", role: "progressbar", "aria-valuenow": done, "aria-valuemax": all, "aria-label": text2, children: [
    /* @__PURE__ */ a4("i", { style: `width:${100 * done / all}%` }),
    /* @__PURE__ */ a4("span", { children: text2 })
  ] });
}
function Legend() {
  if (store.data.comparison.value) {
    const changes = ["added", "removed", "changed"];
    return /* @__PURE__ */ a4("div", { class: "legend", "aria-hidden": "true", children: changes.map((change3) => /* @__PURE__ */ a4("span", { children: [
      /* @__PURE__ */ a4("b", { class: change3 }),
      CHANGE_SIGNS[change3],
      " ",
      change3
    ] })) });
  }
  store.playback.watchSlowly();
  const scale = heatScale(store.view.numbers.value, store.playback.shown().states, store.data.model.value);
  return /* @__PURE__ */ a4("div", { class: "legend", "aria-hidden": "true", children: [
    scale && /* @__PURE__ */ a4("span", { class: "scale", children: [
      scale[0],
      /* @__PURE__ */ a4("b", { class: "heat" }),
      scale[1]
    ] }),
    LEGEND.map(([kind, text2]) => /* @__PURE__ */ a4("span", { children: [
      /* @__PURE__ */ a4("b", { class: kind }),
      text2
    ] })),
    store.view.overview.value && /* @__PURE__ */ a4("span", { class: "hint", title: "double-click opens a state with its arrows", children: "double-click opens one" })
  ] });
}
function Notice() {
  const notice = store.view.notice.value;
  return /* @__PURE__ */ a4("div", { class: "notices", "aria-live": "assertive", children: notice && /* @__PURE__ */ a4("div", { class: `notice ${notice.kind}`, children: notice.text }) });
}
function Help() {
  if (!store.view.help.value) return null;
  const close2 = () => {
    store.view.help.value = false;
  };
  return /* @__PURE__ */ a4(Dialog, { label: "keys", class: "keys", onClose: close2, children: [
    /* @__PURE__ */ a4("header", { children: [
      /* @__PURE__ */ a4("h2", { children: "Keys" }),
      /* @__PURE__ */ a4("button", { onClick: close2, children: "Close" })
    ] }),
    /* @__PURE__ */ a4("dl", { children: KEYS2.map(([key, text2]) => /* @__PURE__ */ a4($, { children: [
      /* @__PURE__ */ a4("dt", { children: /* @__PURE__ */ a4("kbd", { children: key }) }),
      /* @__PURE__ */ a4("dd", { children: text2 })
    ] })) })
  ] });
}
function TokenDialog() {
  const [text2, setText] = d2("");
  const [wrong, setWrong] = d2(false);
  if (!store.view.tokenAsked.value) return null;
  const close2 = () => {
    store.view.tokenAsked.value = false;
  };
  const onSubmit = (e4) => {
    e4.preventDefault();
    const taken = takeToken(text2);
    setWrong(!taken);
    if (taken) setText("");
  };
  return /* @__PURE__ */ a4(Dialog, { label: "token", class: "token", onClose: close2, children: /* @__PURE__ */ a4("form", { onSubmit, children: [
    /* @__PURE__ */ a4("h2", { children: "The viewer has a new token" }),
    /* @__PURE__ */ a4("p", { children: "It was restarted. Paste the printed address, or the token at its end." }),
    /* @__PURE__ */ a4(
      "input",
      {
        "aria-label": "address or token",
        autocomplete: "off",
        spellcheck: false,
        value: text2,
        autofocus: true,
        onInput: (e4) => setText(fieldValue(e4))
      }
    ),
    wrong && /* @__PURE__ */ a4("p", { class: "problem", children: "no token; expected ADDRESS/#token=TOKEN, or TOKEN" }),
    /* @__PURE__ */ a4("p", { children: [
      /* @__PURE__ */ a4("button", { class: "primary", type: "submit", children: "Use it" }),
      " ",
      /* @__PURE__ */ a4("button", { type: "button", onClick: close2, children: "Only look" })
    ] })
  ] }) });
}

// src/core/palette.ts
var SIGNS2 = { ">": "command", "@": "state", ".": "key", ":": "instant", "#": "run" };
var ORDER = ["instant", "state", "command", "run", "key"];
var MOST5 = 40;
function asked(text2) {
  const kind = SIGNS2[text2.trimStart()[0]] ?? null;
  return { kind, words: kind ? text2.trimStart().slice(1).trim() : text2.trim() };
}
function ranked(items3, text2) {
  const { kind, words: words2 } = asked(text2);
  const parts = words2.toLowerCase().split(/\s+/).filter(Boolean);
  const found = items3.filter((item) => {
    if (kind !== null && item.kind !== kind) return false;
    const all = `${item.name} ${item.more}`.toLowerCase();
    return item.kind === "instant" || parts.every((part) => all.includes(part));
  });
  const rank = ({ name, kind: of }) => {
    const low = name.toLowerCase();
    const place = low.startsWith(parts[0] ?? "") ? 0 : parts.every((part) => low.includes(part)) ? 1 : 2;
    return place * ORDER.length + ORDER.indexOf(of);
  };
  const ranks = new Map(found.map((item) => [item, rank(item)]));
  return found.sort((a5, b3) => (ranks.get(a5) ?? 0) - (ranks.get(b3) ?? 0)).slice(0, MOST5);
}

// src/panels/palette.tsx
var MOST_RUNS = 300;
function itemsNow(page2, text2) {
  return [...instants(text2), ...commands(page2), ...states(page2), ...keys(page2), ...runs()];
}
function instants(text2) {
  const seconds = parseInstant(asked(text2).words);
  const began = store.playback.began();
  if (seconds === null || began === null) return [];
  const at = began + 1e3 * seconds;
  return [{ kind: "instant", name: store.clock.runText(at), more: "go there", pick: () => store.playback.seek(at) }];
}
function commands(page2) {
  const item = (name, keys2, pick, more = "") => {
    return { kind: "command", name, more, keys: keys2, pick };
  };
  const found = [];
  if (!isFile())
    found.push(
      item("Runs", "h", () => showPage("runs"), "live and past runs"),
      item("Fleet", "", () => showPage("fleet"), "the live runs together"),
      item("Actions", "a", () => showPage("actions"), "send goals, see those of others")
    );
  found.push(
    item(isDark() ? "Light colours" : "Dark colours", "d", () => page2.setTheme(isDark() ? "light" : "dark")),
    item("All keys", "?", () => {
      store.view.help.value = true;
    })
  );
  if (!store.data.model.value) return found;
  const facts = control();
  if (facts && hasToken() && store.status.whyDisarmed.value === null) {
    const [name, what] = facts.paused ? ["resume", "Resume"] : ["pause", "Pause"];
    found.push(item(`${what} ${targetText()}`, "Space", () => command(name)));
    if (facts.paused) found.push(item(`Step ${targetText()}`, "s", () => command("step")));
  }
  found.push(
    item(
      store.view.follow.value ? "Do not follow" : "Follow",
      "o",
      () => page2.layouts.setFollow(!store.view.follow.value),
      "what runs"
    ),
    item("Live", "l", () => page2.timeline.live(), "the present, or the end"),
    item("Show everything", "0", () => page2.layouts.refit()),
    item("Whole run", "", () => page2.timeline.window.fitAll(), "in the timeline"),
    item("Next failure", "f", () => store.playback.jump("kind failure", 1)),
    item("Next preempt", "p", () => store.playback.jump("kind preempt", 1)),
    item("Next goal", "g", () => store.playback.jump("kind goal", 1)),
    item("Why?", "w", () => showWhy(), "from the first cause to the outcome"),
    ...canReproduce() ? [
      item("Reproduce this run", "", () => reproduce("run"), "with today's code, answered as it was then"),
      item("Make a test of this run", "", () => reproduce("test"), "for pytest")
    ] : [],
    item("Note", "n", () => store.notes.begin(), "at the instant shown"),
    item("Implicit transitions", "i", () => page2.layouts.setImplicit(!store.view.implicit.value), "show or hide")
  );
  return found;
}
var states = (page2) => (store.data.model.value?.order ?? []).map((node) => ({
  kind: "state",
  name: node.name,
  more: node.parent ? node.parent.path : KIND_NAMES[node.kind],
  pick: () => page2.goTo(node.path)
}));
var keys = (page2) => Object.values(store.playback.shown().userdata).map(({ key, value, writer, at }) => ({
  kind: "key",
  name: key,
  more: `${brief(value).slice(0, 60)} by ${store.data.nameOf(writer)}`,
  pick: () => {
    store.playback.followedKey.value = key;
    page2.goTo(writer);
    if (store.playback.cursor.value !== null || !store.playback.goes.value) store.playback.seek(at / 1e6);
  }
}));
function runs() {
  const machines = store.data.machines.value.map(
    ({ name, label, recorded }) => ({
      kind: "run",
      name: label,
      more: `${name}${recorded ? ", recorded" : ""}`,
      pick: () => choose(name)
    })
  );
  const others = store.data.runs.value.runs.filter(({ name }) => name === null).slice(0, MOST_RUNS);
  const past = others.map(
    ({ id, machine, outcome, file }) => ({
      kind: "run",
      name: machine,
      more: [outcome, file].filter(Boolean).join(", "),
      pick: () => openRun(id)
    })
  );
  return [...machines, ...past];
}
var SIGN_OF = Object.fromEntries(Object.entries(SIGNS2).map(([sign2, kind]) => [kind, sign2]));
function Palette({ page: page2 }) {
  return store.view.paletteOpen.value ? /* @__PURE__ */ a4(Open, { page: page2 }) : null;
}
var close = () => {
  store.view.paletteOpen.value = false;
};
function Open({ page: page2 }) {
  const [text2, setText] = d2("");
  const [at, setAt] = d2(0);
  const list = T2(null);
  A2(() => {
    if (!isFile()) refreshRuns();
  }, []);
  const found = ranked(itemsNow(page2, text2), text2);
  const chosen2 = Math.min(at, found.length - 1);
  A2(() => list.current?.children[chosen2]?.scrollIntoView({ block: "nearest" }), [chosen2]);
  const pick = (item) => {
    if (!item) return;
    close();
    if (["state", "key", "instant"].includes(item.kind)) showPage("machine");
    item.pick();
  };
  const onKeyDown = (e4) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[e4.key];
    if (e4.key === "Enter") pick(found[chosen2]);
    else if (step) setAt(Math.max(0, Math.min(chosen2 + step, found.length - 1)));
    else return;
    e4.preventDefault();
    e4.stopPropagation();
  };
  const onInput = (e4) => {
    setText(fieldValue(e4));
    setAt(0);
  };
  return /* @__PURE__ */ a4(Dialog, { label: "find", class: "palette", onClose: close, children: [
    /* @__PURE__ */ a4(
      "input",
      {
        role: "combobox",
        "aria-expanded": true,
        "aria-controls": "palette-list",
        "aria-activedescendant": found.length ? `palette-${chosen2}` : void 0,
        "aria-label": "Find states, runs, instants, keys and commands",
        placeholder: "Find or do…",
        autocomplete: "off",
        spellcheck: false,
        value: text2,
        onInput,
        onKeyDown
      }
    ),
    /* @__PURE__ */ a4("ul", { id: "palette-list", role: "listbox", "aria-label": "found", ref: list, children: [
      found.map((item, i4) => /* @__PURE__ */ a4(
        "li",
        {
          id: `palette-${i4}`,
          role: "option",
          "aria-selected": i4 === chosen2,
          class: i4 === chosen2 ? "at" : "",
          onClick: () => pick(item),
          children: [
            /* @__PURE__ */ a4("i", { "aria-hidden": "true", children: SIGN_OF[item.kind] }),
            /* @__PURE__ */ a4("b", { children: shorten(item.name, 60) }),
            /* @__PURE__ */ a4("small", { children: shorten(item.more, 90) }),
            item.keys && /* @__PURE__ */ a4("kbd", { children: item.keys })
          ]
        }
      )),
      !found.length && /* @__PURE__ */ a4("li", { class: "none", children: "nothing of this name" })
    ] }),
    /* @__PURE__ */ a4("p", { class: "hint", children: Object.entries(SIGNS2).map(([sign2, kind]) => /* @__PURE__ */ a4("span", { children: [
      /* @__PURE__ */ a4("kbd", { children: sign2 }),
      " ",
      kind,
      "s",
      " "
    ] }, sign2)) })
  ] });
}

// src/panels/play.tsx
var ICONS2 = {
  begin: "M4 3v10M13 3 6 8l7 5Z",
  back: "M11 3 5 8l6 5Z",
  play: "M5 3l8 5-8 5Z",
  pause: "M5 3v10M11 3v10",
  forward: "M5 3l6 5-6 5Z",
  end: "M12 3v10M3 3l7 5-7 5Z",
  loop: "M12 7V5H3.5M5.5 3l-2 2 2 2M4 9v2h8.5M10.5 9l2 2-2 2"
};
var KINDS2 = [
  ["failure", "✕", "F"],
  ["preempt", "⊘", "P"],
  ["goal", "◎", "G"]
];
var IconButton = ({
  name,
  title,
  ...more
}) => /* @__PURE__ */ a4("button", { class: "icon-button", title, "aria-label": title, ...more, children: /* @__PURE__ */ a4("svg", { viewBox: "0 0 16 16", "aria-hidden": "true", children: /* @__PURE__ */ a4("path", { d: ICONS2[name] }) }) });
function PlayBar({ page: page2 }) {
  store.playback.watch();
  const first = store.data.run.first();
  if (first === null) return null;
  const goes = store.playback.goes.value;
  const live = store.playback.cursor.value === null;
  const end = isFile() || store.data.facts.value?.recorded ? "End" : "Live";
  return /* @__PURE__ */ a4("div", { class: "play", role: "region", "aria-label": "play bar", children: [
    /* @__PURE__ */ a4("span", { class: "group", children: [
      /* @__PURE__ */ a4(IconButton, { name: "begin", title: "to the beginning (Home)", onClick: () => store.playback.seek(first) }),
      /* @__PURE__ */ a4(IconButton, { name: "back", title: "one event back (,)", onClick: () => store.playback.seekEvent(-1) }),
      /* @__PURE__ */ a4(
        IconButton,
        {
          name: goes ? "pause" : "play",
          title: goes ? "hold the picture" : "play",
          id: "play",
          onClick: () => store.playback.togglePlaying()
        }
      ),
      /* @__PURE__ */ a4(IconButton, { name: "forward", title: "one event forward (.)", onClick: () => store.playback.seekEvent(1) }),
      /* @__PURE__ */ a4(
        IconButton,
        {
          name: "end",
          class: "icon-button to-end",
          title: "to the end (End)",
          onClick: () => page2.timeline.live()
        }
      )
    ] }),
    /* @__PURE__ */ a4(Clock2, {}),
    /* @__PURE__ */ a4("label", { class: "rate", children: [
      /* @__PURE__ */ a4("span", { class: "hidden", children: "speed" }),
      /* @__PURE__ */ a4(
        "select",
        {
          value: store.playback.rate.value,
          title: "speed",
          onChange: (e4) => store.playback.setRate(Number(fieldValue(e4))),
          children: RATES.map((rate) => /* @__PURE__ */ a4("option", { value: rate, children: [
            rate,
            " ×"
          ] }))
        }
      )
    ] }),
    /* @__PURE__ */ a4(LoopButton, {}),
    /* @__PURE__ */ a4(Jumps, {}),
    /* @__PURE__ */ a4("span", { class: "spread" }),
    /* @__PURE__ */ a4(
      "button",
      {
        title: "back to now (l)",
        class: `live-button ${live ? "on" : ""}`,
        "aria-pressed": live,
        onClick: () => page2.timeline.live(),
        children: end
      }
    )
  ] });
}
function LoopButton() {
  const [on2, found] = [store.playback.looping.value, store.playback.stretch.value];
  const what = found ? `from ${store.clock.instantText(found.from)} to ${store.clock.instantText(found.to)}` : "over the selected state's visit; drag in the timeline to select a stretch";
  return /* @__PURE__ */ a4(
    IconButton,
    {
      name: "loop",
      class: `icon-button ${on2 ? "on" : ""}`,
      "aria-pressed": on2,
      id: "loop",
      title: `loop ${what} (r)`,
      onClick: () => store.playback.toggleLoop()
    }
  );
}
function Clock2() {
  store.playback.watch();
  const last = store.data.run.last() ?? 0;
  const [typed, setTyped] = d2(null);
  const onChange = (e4) => {
    const seconds = parseInstant(fieldValue(e4));
    if (seconds === null)
      store.view.notify(`Instant: got ${shorten(fieldValue(e4), 30)}; expected such as 01:32.5`, "error");
    else store.playback.seek((store.playback.began() ?? 0) + seconds * 1e3);
    e4.target.blur();
  };
  const onFocus = (e4) => {
    setTyped(fieldValue(e4));
    e4.target.select();
  };
  const text2 = typed ?? store.clock.runText(store.playback.nowMs());
  return /* @__PURE__ */ a4("span", { class: "clock", children: [
    /* @__PURE__ */ a4(
      "input",
      {
        value: text2,
        style: { width: `${Math.max(9, text2.length + 1.5)}ch` },
        "aria-label": "instant shown; type another one",
        title: "type an instant to go there",
        autocomplete: "off",
        onInput: (e4) => setTyped(fieldValue(e4)),
        onChange,
        onFocus,
        onBlur: () => setTyped(null)
      }
    ),
    /* @__PURE__ */ a4("small", { children: [
      "/ ",
      store.clock.runText(Math.max(last, store.playback.nowMs()))
    ] })
  ] });
}
function Jumps() {
  store.playback.watchSlowly();
  const keys2 = [...store.data.marks.keys].sort();
  const key = store.playback.followedKey.value ?? keys2[0];
  const choose2 = (e4) => {
    store.playback.followedKey.value = fieldValue(e4);
  };
  return /* @__PURE__ */ a4("span", { class: "jumps", role: "group", "aria-label": "go to the next", children: [
    /* @__PURE__ */ a4("span", { class: "hint", children: "Next" }),
    KINDS2.map(([kind, sign2, letter]) => /* @__PURE__ */ a4(Jump, { name: `kind ${kind}`, letter, children: [
      /* @__PURE__ */ a4("i", { class: `to-${kind}`, children: sign2 }),
      " ",
      /* @__PURE__ */ a4("span", { class: "kind", children: kind })
    ] })),
    keys2.length > 0 && /* @__PURE__ */ a4($, { children: [
      /* @__PURE__ */ a4("select", { value: key, onChange: choose2, "aria-label": "key of userdata", title: `key of userdata: ${key}`, children: keys2.map((one) => /* @__PURE__ */ a4("option", { value: one, children: shorten(one, 24) })) }),
      /* @__PURE__ */ a4(Jump, { name: `key ${key}`, letter: "K", children: [
        /* @__PURE__ */ a4("i", { children: "Δ" }),
        " ",
        /* @__PURE__ */ a4("span", { class: "kind", children: "change" })
      ] })
    ] })
  ] });
}
function Jump({ name, letter, children }) {
  const ahead = store.playback.jumpOf(name, 1) !== null;
  const title = `${ahead ? "go there" : "none ahead"} (${letter.toLowerCase()}); before it: Shift+${letter}`;
  return /* @__PURE__ */ a4(
    "button",
    {
      class: ahead ? "" : "none",
      "aria-disabled": !ahead,
      title,
      onClick: (e4) => store.playback.jump(name, e4.shiftKey ? -1 : 1),
      children: [
        children,
        /* @__PURE__ */ a4("kbd", { children: letter })
      ]
    }
  );
}

// node_modules/uplot/dist/uPlot.esm.js
var FEAT_TIME = true;
var pre = "u-";
var UPLOT = "uplot";
var ORI_HZ = pre + "hz";
var ORI_VT = pre + "vt";
var TITLE = pre + "title";
var WRAP = pre + "wrap";
var UNDER = pre + "under";
var OVER = pre + "over";
var AXIS = pre + "axis";
var OFF = pre + "off";
var SELECT = pre + "select";
var CURSOR_X = pre + "cursor-x";
var CURSOR_Y = pre + "cursor-y";
var CURSOR_PT = pre + "cursor-pt";
var LEGEND2 = pre + "legend";
var LEGEND_LIVE = pre + "live";
var LEGEND_INLINE = pre + "inline";
var LEGEND_SERIES = pre + "series";
var LEGEND_MARKER = pre + "marker";
var LEGEND_LABEL = pre + "label";
var LEGEND_VALUE = pre + "value";
var WIDTH3 = "width";
var HEIGHT = "height";
var TOP2 = "top";
var BOTTOM = "bottom";
var LEFT = "left";
var RIGHT3 = "right";
var hexBlack = "#000";
var transparent = hexBlack + "0";
var mousemove = "mousemove";
var mousedown = "mousedown";
var mouseup = "mouseup";
var mouseenter = "mouseenter";
var mouseleave = "mouseleave";
var dblclick = "dblclick";
var resize = "resize";
var scroll = "scroll";
var change2 = "change";
var dppxchange = "dppxchange";
var LEGEND_DISP = "--";
var domEnv = typeof window != "undefined";
var doc = domEnv ? document : null;
var win = domEnv ? window : null;
var nav = domEnv ? navigator : null;
var pxRatio;
var query;
function setPxRatio() {
  let _pxRatio = devicePixelRatio;
  if (pxRatio != _pxRatio) {
    pxRatio = _pxRatio;
    query && off(change2, query, setPxRatio);
    query = matchMedia(`(min-resolution: ${pxRatio - 1e-3}dppx) and (max-resolution: ${pxRatio + 1e-3}dppx)`);
    on(change2, query, setPxRatio);
    win.dispatchEvent(new CustomEvent(dppxchange));
  }
}
function addClass(el2, c4) {
  if (c4 != null) {
    let cl = el2.classList;
    !cl.contains(c4) && cl.add(c4);
  }
}
function remClass(el2, c4) {
  let cl = el2.classList;
  cl.contains(c4) && cl.remove(c4);
}
function setStylePx(el2, name, value) {
  el2.style[name] = value + "px";
}
function placeTag(tag, cls, targ, refEl) {
  let el2 = doc.createElement(tag);
  if (cls != null)
    addClass(el2, cls);
  if (targ != null)
    targ.insertBefore(el2, refEl);
  return el2;
}
function placeDiv(cls, targ) {
  return placeTag("div", cls, targ);
}
var xformCache = /* @__PURE__ */ new WeakMap();
function elTrans(el2, xPos, yPos, xMax, yMax) {
  let xform = "translate(" + xPos + "px," + yPos + "px)";
  let xformOld = xformCache.get(el2);
  if (xform != xformOld) {
    el2.style.transform = xform;
    xformCache.set(el2, xform);
    if (xPos < 0 || yPos < 0 || xPos > xMax || yPos > yMax)
      addClass(el2, OFF);
    else
      remClass(el2, OFF);
  }
}
var colorCache = /* @__PURE__ */ new WeakMap();
function elColor(el2, background, borderColor) {
  let newColor = background + borderColor;
  let oldColor = colorCache.get(el2);
  if (newColor != oldColor) {
    colorCache.set(el2, newColor);
    el2.style.background = background;
    el2.style.borderColor = borderColor;
  }
}
var sizeCache = /* @__PURE__ */ new WeakMap();
function elSize(el2, newWid, newHgt, centered) {
  let newSize = newWid + "" + newHgt;
  let oldSize = sizeCache.get(el2);
  if (newSize != oldSize) {
    sizeCache.set(el2, newSize);
    el2.style.height = newHgt + "px";
    el2.style.width = newWid + "px";
    el2.style.marginLeft = centered ? -newWid / 2 + "px" : 0;
    el2.style.marginTop = centered ? -newHgt / 2 + "px" : 0;
  }
}
var evOpts = { passive: true };
var evOpts2 = { ...evOpts, capture: true };
function on(ev, el2, cb, capt) {
  el2.addEventListener(ev, cb, capt ? evOpts2 : evOpts);
}
function off(ev, el2, cb, capt) {
  el2.removeEventListener(ev, cb, evOpts);
}
domEnv && setPxRatio();
function closestIdx(num, arr, lo, hi) {
  let mid;
  lo = lo || 0;
  hi = hi || arr.length - 1;
  let bitwise = hi <= 2147483647;
  while (hi - lo > 1) {
    mid = bitwise ? lo + hi >> 1 : floor((lo + hi) / 2);
    if (arr[mid] < num)
      lo = mid;
    else
      hi = mid;
  }
  if (num - arr[lo] <= arr[hi] - num)
    return lo;
  return hi;
}
function makeIndexOfs(predicate) {
  let indexOfs = (data, _i0, _i1) => {
    let i0 = -1;
    let i1 = -1;
    for (let i4 = _i0; i4 <= _i1; i4++) {
      if (predicate(data[i4])) {
        i0 = i4;
        break;
      }
    }
    for (let i4 = _i1; i4 >= _i0; i4--) {
      if (predicate(data[i4])) {
        i1 = i4;
        break;
      }
    }
    return [i0, i1];
  };
  return indexOfs;
}
var notNullish = (v4) => v4 != null;
var isPositive = (v4) => v4 != null && v4 > 0;
var nonNullIdxs = makeIndexOfs(notNullish);
var positiveIdxs = makeIndexOfs(isPositive);
function getMinMax(data, _i0, _i1, sorted2 = 0, log = false) {
  let getEdgeIdxs = log ? positiveIdxs : nonNullIdxs;
  let predicate = log ? isPositive : notNullish;
  [_i0, _i1] = getEdgeIdxs(data, _i0, _i1);
  let _min = data[_i0];
  let _max = data[_i0];
  if (_i0 > -1) {
    if (sorted2 == 1) {
      _min = data[_i0];
      _max = data[_i1];
    } else if (sorted2 == -1) {
      _min = data[_i1];
      _max = data[_i0];
    } else {
      for (let i4 = _i0; i4 <= _i1; i4++) {
        let v4 = data[i4];
        if (predicate(v4)) {
          if (v4 < _min)
            _min = v4;
          else if (v4 > _max)
            _max = v4;
        }
      }
    }
  }
  return [_min ?? inf, _max ?? -inf];
}
function rangeLog(min2, max2, base, fullMags) {
  let minSign = sign(min2);
  let maxSign = sign(max2);
  if (min2 == max2) {
    if (minSign == -1) {
      min2 *= base;
      max2 /= base;
    } else {
      min2 /= base;
      max2 *= base;
    }
  }
  let logFn = base == 10 ? log10 : log2;
  let growMinAbs = minSign == 1 ? floor : ceil;
  let growMaxAbs = maxSign == 1 ? ceil : floor;
  let minExp = growMinAbs(logFn(abs(min2)));
  let maxExp = growMaxAbs(logFn(abs(max2)));
  let minIncr = pow(base, minExp);
  let maxIncr = pow(base, maxExp);
  if (base == 10) {
    if (minExp < 0)
      minIncr = roundDec(minIncr, -minExp);
    if (maxExp < 0)
      maxIncr = roundDec(maxIncr, -maxExp);
  }
  if (fullMags || base == 2) {
    min2 = minIncr * minSign;
    max2 = maxIncr * maxSign;
  } else {
    min2 = incrRoundDn(min2, minIncr);
    max2 = incrRoundUp(max2, maxIncr);
  }
  return [min2, max2];
}
function rangeAsinh(min2, max2, base, fullMags) {
  let minMax = rangeLog(min2, max2, base, fullMags);
  if (min2 == 0)
    minMax[0] = 0;
  if (max2 == 0)
    minMax[1] = 0;
  return minMax;
}
var rangePad = 0.1;
var autoRangePart = {
  mode: 3,
  pad: rangePad
};
var _eqRangePart = {
  pad: 0,
  soft: null,
  mode: 0
};
var _eqRange = {
  min: _eqRangePart,
  max: _eqRangePart
};
function rangeNum(_min, _max, mult, extra) {
  if (isObj(mult))
    return _rangeNum(_min, _max, mult);
  _eqRangePart.pad = mult;
  _eqRangePart.soft = extra ? 0 : null;
  _eqRangePart.mode = extra ? 3 : 0;
  return _rangeNum(_min, _max, _eqRange);
}
function ifNull(lh, rh) {
  return lh == null ? rh : lh;
}
function hasData(data, idx0, idx1) {
  idx0 = ifNull(idx0, 0);
  idx1 = ifNull(idx1, data.length - 1);
  while (idx0 <= idx1) {
    if (data[idx0] != null)
      return true;
    idx0++;
  }
  return false;
}
function _rangeNum(_min, _max, cfg) {
  let cmin = cfg.min;
  let cmax = cfg.max;
  let padMin = ifNull(cmin.pad, 0);
  let padMax = ifNull(cmax.pad, 0);
  let hardMin = ifNull(cmin.hard, -inf);
  let hardMax = ifNull(cmax.hard, inf);
  let softMin = ifNull(cmin.soft, inf);
  let softMax = ifNull(cmax.soft, -inf);
  let softMinMode = ifNull(cmin.mode, 0);
  let softMaxMode = ifNull(cmax.mode, 0);
  let delta = _max - _min;
  let deltaMag = log10(delta);
  let scalarMax = max(abs(_min), abs(_max));
  let scalarMag = log10(scalarMax);
  let scalarMagDelta = abs(scalarMag - deltaMag);
  if (delta < 1e-24 || scalarMagDelta > 10) {
    delta = 0;
    if (_min == 0 || _max == 0) {
      delta = 1e-24;
      if (softMinMode == 2 && softMin != inf)
        padMin = 0;
      if (softMaxMode == 2 && softMax != -inf)
        padMax = 0;
    }
  }
  let nonZeroDelta = delta || scalarMax || 1e3;
  let mag = log10(nonZeroDelta);
  let base = pow(10, floor(mag));
  let _padMin = nonZeroDelta * (delta == 0 ? _min == 0 ? 0.1 : 1 : padMin);
  let _newMin = roundDec(incrRoundDn(_min - _padMin, base / 10), 24);
  let _softMin = _min >= softMin && (softMinMode == 1 || softMinMode == 3 && _newMin <= softMin || softMinMode == 2 && _newMin >= softMin) ? softMin : inf;
  let minLim = max(hardMin, _newMin < _softMin && _min >= _softMin ? _softMin : min(_softMin, _newMin));
  let _padMax = nonZeroDelta * (delta == 0 ? _max == 0 ? 0.1 : 1 : padMax);
  let _newMax = roundDec(incrRoundUp(_max + _padMax, base / 10), 24);
  let _softMax = _max <= softMax && (softMaxMode == 1 || softMaxMode == 3 && _newMax >= softMax || softMaxMode == 2 && _newMax <= softMax) ? softMax : -inf;
  let maxLim = min(hardMax, _newMax > _softMax && _max <= _softMax ? _softMax : max(_softMax, _newMax));
  if (minLim == maxLim && minLim == 0)
    maxLim = 100;
  return [minLim, maxLim];
}
var numFormatter = new Intl.NumberFormat(domEnv ? nav.language : "en-US");
var fmtNum = (val) => numFormatter.format(val);
var M2 = Math;
var PI = M2.PI;
var abs = M2.abs;
var floor = M2.floor;
var round = M2.round;
var ceil = M2.ceil;
var min = M2.min;
var max = M2.max;
var pow = M2.pow;
var sign = M2.sign;
var log10 = M2.log10;
var log2 = M2.log2;
var sinh = (v4, linthresh = 1) => M2.sinh(v4) * linthresh;
var asinh = (v4, linthresh = 1) => M2.asinh(v4 / linthresh);
var inf = Infinity;
function numIntDigits(x3) {
  return (log10((x3 ^ x3 >> 31) - (x3 >> 31)) | 0) + 1;
}
function clamp(num, _min, _max) {
  return min(max(num, _min), _max);
}
function isFn(v4) {
  return typeof v4 == "function";
}
function fnOrSelf(v4) {
  return isFn(v4) ? v4 : () => v4;
}
var noop = () => {
};
var retArg0 = (_0) => _0;
var retArg1 = (_0, _1) => _1;
var retNull = (_5) => null;
var retTrue = (_5) => true;
var retEq = (a5, b3) => a5 == b3;
var regex6 = /\.\d*?(?=9{6,}|0{6,})/gm;
var fixFloat = (val) => {
  if (isInt(val) || fixedDec.has(val))
    return val;
  const str = `${val}`;
  const match = str.match(regex6);
  if (match == null)
    return val;
  let len = match[0].length - 1;
  if (str.indexOf("e-") != -1) {
    let [num, exp] = str.split("e");
    return +`${fixFloat(num)}e${exp}`;
  }
  return roundDec(val, len);
};
function incrRound(num, incr) {
  return fixFloat(roundDec(fixFloat(num / incr)) * incr);
}
function incrRoundUp(num, incr) {
  return fixFloat(ceil(fixFloat(num / incr)) * incr);
}
function incrRoundDn(num, incr) {
  return fixFloat(floor(fixFloat(num / incr)) * incr);
}
function roundDec(val, dec = 0) {
  if (isInt(val))
    return val;
  let p5 = 10 ** dec;
  let n3 = val * p5 * (1 + Number.EPSILON);
  return round(n3) / p5;
}
var fixedDec = /* @__PURE__ */ new Map();
function guessDec(num) {
  return (("" + num).split(".")[1] || "").length;
}
function genIncrs(base, minExp, maxExp, mults) {
  let incrs = [];
  let multDec = mults.map(guessDec);
  for (let exp = minExp; exp < maxExp; exp++) {
    let expa = abs(exp);
    let mag = roundDec(pow(base, exp), expa);
    for (let i4 = 0; i4 < mults.length; i4++) {
      let _incr = base == 10 ? +`${mults[i4]}e${exp}` : mults[i4] * mag;
      let dec = (exp >= 0 ? 0 : expa) + (exp >= multDec[i4] ? 0 : multDec[i4]);
      let incr = base == 10 ? _incr : roundDec(_incr, dec);
      incrs.push(incr);
      fixedDec.set(incr, dec);
    }
  }
  return incrs;
}
var EMPTY_OBJ = {};
var EMPTY_ARR = [];
var nullNullTuple = [null, null];
var isArr = Array.isArray;
var isInt = Number.isInteger;
var isUndef = (v4) => v4 === void 0;
function isStr(v4) {
  return typeof v4 == "string";
}
function isObj(v4) {
  let is = false;
  if (v4 != null) {
    let c4 = v4.constructor;
    is = c4 == null || c4 == Object;
  }
  return is;
}
function fastIsObj(v4) {
  return v4 != null && typeof v4 == "object";
}
var TypedArray = Object.getPrototypeOf(Uint8Array);
var __proto__ = "__proto__";
function copy(o5, _isObj = isObj) {
  let out;
  if (isArr(o5)) {
    let val = o5.find((v4) => v4 != null);
    if (isArr(val) || _isObj(val)) {
      out = Array(o5.length);
      for (let i4 = 0; i4 < o5.length; i4++)
        out[i4] = copy(o5[i4], _isObj);
    } else
      out = o5.slice();
  } else if (o5 instanceof TypedArray)
    out = o5.slice();
  else if (_isObj(o5)) {
    out = {};
    for (let k4 in o5) {
      if (k4 != __proto__)
        out[k4] = copy(o5[k4], _isObj);
    }
  } else
    out = o5;
  return out;
}
function assign(targ) {
  let args = arguments;
  for (let i4 = 1; i4 < args.length; i4++) {
    let src = args[i4];
    for (let key in src) {
      if (key != __proto__) {
        if (isObj(targ[key]))
          assign(targ[key], copy(src[key]));
        else
          targ[key] = copy(src[key]);
      }
    }
  }
  return targ;
}
var NULL_REMOVE = 0;
var NULL_RETAIN = 1;
var NULL_EXPAND = 2;
function nullExpand(yVals, nullIdxs, alignedLen) {
  for (let i4 = 0, xi, lastNullIdx = -1; i4 < nullIdxs.length; i4++) {
    let nullIdx = nullIdxs[i4];
    if (nullIdx > lastNullIdx) {
      xi = nullIdx - 1;
      while (xi >= 0 && yVals[xi] == null)
        yVals[xi--] = null;
      xi = nullIdx + 1;
      while (xi < alignedLen && yVals[xi] == null)
        yVals[lastNullIdx = xi++] = null;
    }
  }
}
function join(tables, nullModes) {
  if (allHeadersSame(tables)) {
    let table = tables[0].slice();
    for (let i4 = 1; i4 < tables.length; i4++)
      table.push(...tables[i4].slice(1));
    if (!isAsc(table[0]))
      table = sortCols(table);
    return table;
  }
  let xVals = /* @__PURE__ */ new Set();
  for (let ti = 0; ti < tables.length; ti++) {
    let t4 = tables[ti];
    let xs = t4[0];
    let len = xs.length;
    for (let i4 = 0; i4 < len; i4++)
      xVals.add(xs[i4]);
  }
  let data = [Array.from(xVals).sort((a5, b3) => a5 - b3)];
  let alignedLen = data[0].length;
  let xIdxs = /* @__PURE__ */ new Map();
  for (let i4 = 0; i4 < alignedLen; i4++)
    xIdxs.set(data[0][i4], i4);
  for (let ti = 0; ti < tables.length; ti++) {
    let t4 = tables[ti];
    let xs = t4[0];
    for (let si = 1; si < t4.length; si++) {
      let ys = t4[si];
      let yVals = Array(alignedLen).fill(void 0);
      let nullMode = nullModes ? nullModes[ti][si] : NULL_RETAIN;
      let nullIdxs = [];
      for (let i4 = 0; i4 < ys.length; i4++) {
        let yVal = ys[i4];
        let alignedIdx = xIdxs.get(xs[i4]);
        if (yVal === null) {
          if (nullMode != NULL_REMOVE) {
            yVals[alignedIdx] = yVal;
            if (nullMode == NULL_EXPAND)
              nullIdxs.push(alignedIdx);
          }
        } else
          yVals[alignedIdx] = yVal;
      }
      nullExpand(yVals, nullIdxs, alignedLen);
      data.push(yVals);
    }
  }
  return data;
}
var microTask = typeof queueMicrotask == "undefined" ? (fn) => Promise.resolve().then(fn) : queueMicrotask;
function sortCols(table) {
  let head2 = table[0];
  let rlen = head2.length;
  let idxs = Array(rlen);
  for (let i4 = 0; i4 < idxs.length; i4++)
    idxs[i4] = i4;
  idxs.sort((i0, i1) => head2[i0] - head2[i1]);
  let table2 = [];
  for (let i4 = 0; i4 < table.length; i4++) {
    let row = table[i4];
    let row2 = Array(rlen);
    for (let j3 = 0; j3 < rlen; j3++)
      row2[j3] = row[idxs[j3]];
    table2.push(row2);
  }
  return table2;
}
function allHeadersSame(tables) {
  let vals0 = tables[0][0];
  let len0 = vals0.length;
  for (let i4 = 1; i4 < tables.length; i4++) {
    let vals1 = tables[i4][0];
    if (vals1.length != len0)
      return false;
    if (vals1 != vals0) {
      for (let j3 = 0; j3 < len0; j3++) {
        if (vals1[j3] != vals0[j3])
          return false;
      }
    }
  }
  return true;
}
function isAsc(vals, samples = 100) {
  const len = vals.length;
  if (len <= 1)
    return true;
  let firstIdx = 0;
  let lastIdx = len - 1;
  while (firstIdx <= lastIdx && vals[firstIdx] == null)
    firstIdx++;
  while (lastIdx >= firstIdx && vals[lastIdx] == null)
    lastIdx--;
  if (lastIdx <= firstIdx)
    return true;
  const stride = max(1, floor((lastIdx - firstIdx + 1) / samples));
  for (let prevVal = vals[firstIdx], i4 = firstIdx + stride; i4 <= lastIdx; i4 += stride) {
    const v4 = vals[i4];
    if (v4 != null) {
      if (v4 <= prevVal)
        return false;
      prevVal = v4;
    }
  }
  return true;
}
var months = [
  "January",
  "February",
  "March",
  "April",
  "May",
  "June",
  "July",
  "August",
  "September",
  "October",
  "November",
  "December"
];
var days = [
  "Sunday",
  "Monday",
  "Tuesday",
  "Wednesday",
  "Thursday",
  "Friday",
  "Saturday"
];
function slice3(str) {
  return str.slice(0, 3);
}
var days3 = days.map(slice3);
var months3 = months.map(slice3);
var engNames = {
  MMMM: months,
  MMM: months3,
  WWWW: days,
  WWW: days3
};
function zeroPad2(int) {
  return (int < 10 ? "0" : "") + int;
}
function zeroPad3(int) {
  return (int < 10 ? "00" : int < 100 ? "0" : "") + int;
}
var subs = {
  // 2019
  YYYY: (d5) => d5.getFullYear(),
  // 19
  YY: (d5) => (d5.getFullYear() + "").slice(2),
  // July
  MMMM: (d5, names) => names.MMMM[d5.getMonth()],
  // Jul
  MMM: (d5, names) => names.MMM[d5.getMonth()],
  // 07
  MM: (d5) => zeroPad2(d5.getMonth() + 1),
  // 7
  M: (d5) => d5.getMonth() + 1,
  // 09
  DD: (d5) => zeroPad2(d5.getDate()),
  // 9
  D: (d5) => d5.getDate(),
  // Monday
  WWWW: (d5, names) => names.WWWW[d5.getDay()],
  // Mon
  WWW: (d5, names) => names.WWW[d5.getDay()],
  // 03
  HH: (d5) => zeroPad2(d5.getHours()),
  // 3
  H: (d5) => d5.getHours(),
  // 9 (12hr, unpadded)
  h: (d5) => {
    let h5 = d5.getHours();
    return h5 == 0 ? 12 : h5 > 12 ? h5 - 12 : h5;
  },
  // AM
  AA: (d5) => d5.getHours() >= 12 ? "PM" : "AM",
  // am
  aa: (d5) => d5.getHours() >= 12 ? "pm" : "am",
  // a
  a: (d5) => d5.getHours() >= 12 ? "p" : "a",
  // 09
  mm: (d5) => zeroPad2(d5.getMinutes()),
  // 9
  m: (d5) => d5.getMinutes(),
  // 09
  ss: (d5) => zeroPad2(d5.getSeconds()),
  // 9
  s: (d5) => d5.getSeconds(),
  // 374
  fff: (d5) => zeroPad3(d5.getMilliseconds())
};
function fmtDate(tpl, names) {
  names = names || engNames;
  let parts = [];
  let R = /\{([a-z]+)\}|[^{]+/gi, m5;
  while (m5 = R.exec(tpl))
    parts.push(m5[0][0] == "{" ? subs[m5[1]] : m5[0]);
  return (d5) => {
    let out = "";
    for (let i4 = 0; i4 < parts.length; i4++)
      out += typeof parts[i4] == "string" ? parts[i4] : parts[i4](d5, names);
    return out;
  };
}
var localTz = new Intl.DateTimeFormat().resolvedOptions().timeZone;
function tzDate(date, tz) {
  let date2;
  if (tz == "UTC" || tz == "Etc/UTC")
    date2 = new Date(+date + date.getTimezoneOffset() * 6e4);
  else if (tz == localTz)
    date2 = date;
  else {
    date2 = new Date(date.toLocaleString("en-US", { timeZone: tz }));
    date2.setMilliseconds(date.getMilliseconds());
  }
  return date2;
}
var onlyWhole = (v4) => v4 % 1 == 0;
var allMults = [1, 2, 2.5, 5];
var decIncrs = genIncrs(10, -32, 0, allMults);
var oneIncrs = genIncrs(10, 0, 32, allMults);
var wholeIncrs = oneIncrs.filter(onlyWhole);
var numIncrs = decIncrs.concat(oneIncrs);
var NL = "\n";
var yyyy = "{YYYY}";
var NLyyyy = NL + yyyy;
var md = "{M}/{D}";
var NLmd = NL + md;
var NLmdyy = NLmd + "/{YY}";
var aa = "{aa}";
var hmm = "{h}:{mm}";
var hmmaa = hmm + aa;
var NLhmmaa = NL + hmmaa;
var ss = ":{ss}";
var _4 = null;
function genTimeStuffs(ms2) {
  let s4 = ms2 * 1e3, m5 = s4 * 60, h5 = m5 * 60, d5 = h5 * 24, mo = d5 * 30, y5 = d5 * 365;
  let subSecIncrs = ms2 == 1 ? genIncrs(10, 0, 3, allMults).filter(onlyWhole) : genIncrs(10, -3, 0, allMults);
  let timeIncrs = subSecIncrs.concat([
    // minute divisors (# of secs)
    s4,
    s4 * 5,
    s4 * 10,
    s4 * 15,
    s4 * 30,
    // hour divisors (# of mins)
    m5,
    m5 * 5,
    m5 * 10,
    m5 * 15,
    m5 * 30,
    // day divisors (# of hrs)
    h5,
    h5 * 2,
    h5 * 3,
    h5 * 4,
    h5 * 6,
    h5 * 8,
    h5 * 12,
    // month divisors TODO: need more?
    d5,
    d5 * 2,
    d5 * 3,
    d5 * 4,
    d5 * 5,
    d5 * 6,
    d5 * 7,
    d5 * 8,
    d5 * 9,
    d5 * 10,
    d5 * 15,
    // year divisors (# months, approx)
    mo,
    mo * 2,
    mo * 3,
    mo * 4,
    mo * 6,
    // century divisors
    y5,
    y5 * 2,
    y5 * 5,
    y5 * 10,
    y5 * 25,
    y5 * 50,
    y5 * 100
  ]);
  const _timeAxisStamps = [
    //   tick incr    default          year                    month   day                   hour    min       sec   mode
    [y5, yyyy, _4, _4, _4, _4, _4, _4, 1],
    [d5 * 28, "{MMM}", NLyyyy, _4, _4, _4, _4, _4, 1],
    [d5, md, NLyyyy, _4, _4, _4, _4, _4, 1],
    [h5, "{h}" + aa, NLmdyy, _4, NLmd, _4, _4, _4, 1],
    [m5, hmmaa, NLmdyy, _4, NLmd, _4, _4, _4, 1],
    [s4, ss, NLmdyy + " " + hmmaa, _4, NLmd + " " + hmmaa, _4, NLhmmaa, _4, 1],
    [ms2, ss + ".{fff}", NLmdyy + " " + hmmaa, _4, NLmd + " " + hmmaa, _4, NLhmmaa, _4, 1]
  ];
  function timeAxisSplits(tzDate2) {
    return (self, axisIdx, scaleMin, scaleMax, foundIncr, foundSpace) => {
      let splits = [];
      let isYr = foundIncr >= y5;
      let isMo = foundIncr >= mo && foundIncr < y5;
      let minDate = tzDate2(scaleMin);
      let minDateTs = roundDec(minDate * ms2, 3);
      let minMin = mkDate(minDate.getFullYear(), isYr ? 0 : minDate.getMonth(), isMo || isYr ? 1 : minDate.getDate());
      let minMinTs = roundDec(minMin * ms2, 3);
      if (isMo || isYr) {
        let moIncr = isMo ? foundIncr / mo : 0;
        let yrIncr = isYr ? foundIncr / y5 : 0;
        let split = minDateTs == minMinTs ? minDateTs : roundDec(mkDate(minMin.getFullYear() + yrIncr, minMin.getMonth() + moIncr, 1) * ms2, 3);
        let splitDate = new Date(round(split / ms2));
        let baseYear = splitDate.getFullYear();
        let baseMonth = splitDate.getMonth();
        for (let i4 = 0; split <= scaleMax; i4++) {
          let next = mkDate(baseYear + yrIncr * i4, baseMonth + moIncr * i4, 1);
          let offs = next - tzDate2(roundDec(next * ms2, 3));
          split = roundDec((+next + offs) * ms2, 3);
          if (split <= scaleMax)
            splits.push(split);
        }
      } else {
        let incr0 = foundIncr >= d5 ? d5 : foundIncr;
        let tzOffset = floor(scaleMin) - floor(minDateTs);
        let split = minMinTs + tzOffset + incrRoundUp(minDateTs - minMinTs, incr0);
        splits.push(split);
        let date0 = tzDate2(split);
        let prevHour = date0.getHours() + date0.getMinutes() / m5 + date0.getSeconds() / h5;
        let incrHours = foundIncr / h5;
        let minSpace = self.axes[axisIdx]._space;
        let pctSpace = foundSpace / minSpace;
        while (1) {
          split = roundDec(split + foundIncr, ms2 == 1 ? 0 : 3);
          if (split > scaleMax)
            break;
          if (incrHours > 1) {
            let expectedHour = floor(roundDec(prevHour + incrHours, 6)) % 24;
            let splitDate = tzDate2(split);
            let actualHour = splitDate.getHours();
            let dstShift = actualHour - expectedHour;
            if (dstShift > 1)
              dstShift = -1;
            split -= dstShift * h5;
            prevHour = (prevHour + incrHours) % 24;
            let prevSplit = splits[splits.length - 1];
            let pctIncr = roundDec((split - prevSplit) / foundIncr, 3);
            if (pctIncr * pctSpace >= 0.7)
              splits.push(split);
          } else
            splits.push(split);
        }
      }
      return splits;
    };
  }
  return [
    timeIncrs,
    _timeAxisStamps,
    timeAxisSplits
  ];
}
var [timeIncrsMs, _timeAxisStampsMs, timeAxisSplitsMs] = genTimeStuffs(1);
var [timeIncrsS, _timeAxisStampsS, timeAxisSplitsS] = genTimeStuffs(1e-3);
genIncrs(2, -53, 53, [1]);
function timeAxisStamps(stampCfg, fmtDate2) {
  return stampCfg.map((s4) => s4.map(
    (v4, i4) => i4 == 0 || i4 == 8 || v4 == null ? v4 : fmtDate2(i4 == 1 || s4[8] == 0 ? v4 : s4[1] + v4)
  ));
}
function timeAxisVals(tzDate2, stamps) {
  return (self, splits, axisIdx, foundSpace, foundIncr) => {
    let s4 = stamps.find((s5) => foundIncr >= s5[0]) || stamps[stamps.length - 1];
    let prevYear;
    let prevMnth;
    let prevDate;
    let prevHour;
    let prevMins;
    let prevSecs;
    return splits.map((split) => {
      let date = tzDate2(split);
      let newYear = date.getFullYear();
      let newMnth = date.getMonth();
      let newDate = date.getDate();
      let newHour = date.getHours();
      let newMins = date.getMinutes();
      let newSecs = date.getSeconds();
      let stamp = newYear != prevYear && s4[2] || newMnth != prevMnth && s4[3] || newDate != prevDate && s4[4] || newHour != prevHour && s4[5] || newMins != prevMins && s4[6] || newSecs != prevSecs && s4[7] || s4[1];
      prevYear = newYear;
      prevMnth = newMnth;
      prevDate = newDate;
      prevHour = newHour;
      prevMins = newMins;
      prevSecs = newSecs;
      return stamp(date);
    });
  };
}
function timeAxisVal(tzDate2, dateTpl) {
  let stamp = fmtDate(dateTpl);
  return (self, splits, axisIdx, foundSpace, foundIncr) => splits.map((split) => stamp(tzDate2(split)));
}
function mkDate(y5, m5, d5) {
  return new Date(y5, m5, d5);
}
function timeSeriesStamp(stampCfg, fmtDate2) {
  return fmtDate2(stampCfg);
}
var _timeSeriesStamp = "{YYYY}-{MM}-{DD} {h}:{mm}{aa}";
function timeSeriesVal(tzDate2, stamp) {
  return (self, val, seriesIdx, dataIdx) => dataIdx == null ? LEGEND_DISP : stamp(tzDate2(val));
}
function legendStroke(self, seriesIdx) {
  let s4 = self.series[seriesIdx];
  return s4.width ? s4.stroke(self, seriesIdx) : s4.points.width ? s4.points.stroke(self, seriesIdx) : null;
}
function legendFill(self, seriesIdx) {
  return self.series[seriesIdx].fill(self, seriesIdx);
}
var legendOpts = {
  show: true,
  live: true,
  isolate: false,
  mount: noop,
  markers: {
    show: true,
    width: 2,
    stroke: legendStroke,
    fill: legendFill,
    dash: "solid"
  },
  idx: null,
  idxs: null,
  values: []
};
function cursorPointShow(self, si) {
  let o5 = self.cursor.points;
  let pt = placeDiv();
  let size = o5.size(self, si);
  setStylePx(pt, WIDTH3, size);
  setStylePx(pt, HEIGHT, size);
  let mar = size / -2;
  setStylePx(pt, "marginLeft", mar);
  setStylePx(pt, "marginTop", mar);
  let width = o5.width(self, si, size);
  width && setStylePx(pt, "borderWidth", width);
  return pt;
}
function cursorPointFill(self, si) {
  let sp = self.series[si].points;
  return sp._fill || sp._stroke;
}
function cursorPointStroke(self, si) {
  let sp = self.series[si].points;
  return sp._stroke || sp._fill;
}
function cursorPointSize(self, si) {
  let sp = self.series[si].points;
  return sp.size;
}
var moveTuple = [0, 0];
function cursorMove(self, mouseLeft1, mouseTop1) {
  moveTuple[0] = mouseLeft1;
  moveTuple[1] = mouseTop1;
  return moveTuple;
}
function filtBtn0(self, targ, handle, onlyTarg = true) {
  return (e4) => {
    e4.button == 0 && (!onlyTarg || e4.target == targ) && handle(e4);
  };
}
function filtTarg(self, targ, handle, onlyTarg = true) {
  return (e4) => {
    (!onlyTarg || e4.target == targ) && handle(e4);
  };
}
var cursorOpts = {
  show: true,
  x: true,
  y: true,
  lock: false,
  move: cursorMove,
  points: {
    one: false,
    show: cursorPointShow,
    size: cursorPointSize,
    width: 0,
    stroke: cursorPointStroke,
    fill: cursorPointFill
  },
  bind: {
    mousedown: filtBtn0,
    mouseup: filtBtn0,
    click: filtBtn0,
    // legend clicks, not .u-over clicks
    dblclick: filtBtn0,
    mousemove: filtTarg,
    mouseleave: filtTarg,
    mouseenter: filtTarg
  },
  drag: {
    setScale: true,
    x: true,
    y: false,
    dist: 0,
    uni: null,
    click: (self, e4) => {
      e4.stopPropagation();
      e4.stopImmediatePropagation();
    },
    _x: false,
    _y: false
  },
  focus: {
    dist: (self, seriesIdx, dataIdx, valPos, curPos) => valPos - curPos,
    prox: -1,
    bias: 0
  },
  hover: {
    skip: [void 0],
    prox: null,
    bias: 0
  },
  left: -10,
  top: -10,
  idx: null,
  dataIdx: null,
  idxs: null,
  event: null
};
var axisLines = {
  show: true,
  stroke: "rgba(0,0,0,0.07)",
  width: 2
  //	dash: [],
};
var grid = assign({}, axisLines, {
  filter: retArg1
});
var ticks = assign({}, grid, {
  size: 10
});
var border = assign({}, axisLines, {
  show: false
});
var font = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, "Noto Sans", sans-serif, "Apple Color Emoji", "Segoe UI Emoji", "Segoe UI Symbol", "Noto Color Emoji"';
var labelFont = "bold " + font;
var lineGap = 1.5;
var xAxisOpts = {
  show: true,
  scale: "x",
  stroke: hexBlack,
  space: 50,
  gap: 5,
  alignTo: 1,
  size: 50,
  labelGap: 0,
  labelSize: 30,
  labelFont,
  side: 2,
  //	class: "x-vals",
  //	incrs: timeIncrs,
  //	values: timeVals,
  //	filter: retArg1,
  grid,
  ticks,
  border,
  font,
  lineGap,
  rotate: 0
};
var numSeriesLabel = "Value";
var timeSeriesLabel = "Time";
var xSeriesOpts = {
  show: true,
  scale: "x",
  auto: false,
  sorted: 1,
  //	label: "Time",
  //	value: v => stamp(new Date(v * 1e3)),
  // internal caches
  min: inf,
  max: -inf,
  idxs: []
};
function numAxisVals(self, splits, axisIdx, foundSpace, foundIncr) {
  return splits.map((v4) => v4 == null ? "" : fmtNum(v4));
}
function numAxisSplits(self, axisIdx, scaleMin, scaleMax, foundIncr, foundSpace, forceMin) {
  let splits = [];
  let numDec = fixedDec.get(foundIncr) || 0;
  scaleMin = forceMin ? scaleMin : roundDec(incrRoundUp(scaleMin, foundIncr), numDec);
  for (let val = scaleMin; val <= scaleMax; val = roundDec(val + foundIncr, numDec))
    splits.push(Object.is(val, -0) ? 0 : val);
  return splits;
}
function logAxisSplits(self, axisIdx, scaleMin, scaleMax, foundIncr, foundSpace, forceMin) {
  const splits = [];
  const logBase = self.scales[self.axes[axisIdx].scale].log;
  const logFn = logBase == 10 ? log10 : log2;
  const exp = floor(logFn(scaleMin));
  foundIncr = pow(logBase, exp);
  if (logBase == 10)
    foundIncr = numIncrs[closestIdx(foundIncr, numIncrs)];
  let split = scaleMin;
  let nextMagIncr = foundIncr * logBase;
  if (logBase == 10)
    nextMagIncr = numIncrs[closestIdx(nextMagIncr, numIncrs)];
  do {
    splits.push(split);
    split = split + foundIncr;
    if (logBase == 10 && !fixedDec.has(split))
      split = roundDec(split, fixedDec.get(foundIncr));
    if (split >= nextMagIncr) {
      foundIncr = split;
      nextMagIncr = foundIncr * logBase;
      if (logBase == 10)
        nextMagIncr = numIncrs[closestIdx(nextMagIncr, numIncrs)];
    }
  } while (split <= scaleMax);
  return splits;
}
function asinhAxisSplits(self, axisIdx, scaleMin, scaleMax, foundIncr, foundSpace, forceMin) {
  let sc = self.scales[self.axes[axisIdx].scale];
  let linthresh = sc.asinh;
  let posSplits = scaleMax > linthresh ? logAxisSplits(self, axisIdx, max(linthresh, scaleMin), scaleMax, foundIncr) : [linthresh];
  let zero = scaleMax >= 0 && scaleMin <= 0 ? [0] : [];
  let negSplits = scaleMin < -linthresh ? logAxisSplits(self, axisIdx, max(linthresh, -scaleMax), -scaleMin, foundIncr) : [linthresh];
  return negSplits.reverse().map((v4) => -v4).concat(zero, posSplits);
}
var RE_ALL = /./;
var RE_12357 = /[12357]/;
var RE_125 = /[125]/;
var RE_1 = /1/;
var _filt = (splits, distr, re, keepMod) => splits.map((v4, i4) => distr == 4 && v4 == 0 || i4 % keepMod == 0 && re.test(v4.toExponential()[v4 < 0 ? 1 : 0]) ? v4 : null);
function log10AxisValsFilt(self, splits, axisIdx, foundSpace, foundIncr) {
  let axis = self.axes[axisIdx];
  let scaleKey = axis.scale;
  let sc = self.scales[scaleKey];
  let valToPos = self.valToPos;
  let minSpace = axis._space;
  let _10 = valToPos(10, scaleKey);
  let re = valToPos(9, scaleKey) - _10 >= minSpace ? RE_ALL : valToPos(7, scaleKey) - _10 >= minSpace ? RE_12357 : valToPos(5, scaleKey) - _10 >= minSpace ? RE_125 : RE_1;
  if (re == RE_1) {
    let magSpace = abs(valToPos(1, scaleKey) - _10);
    if (magSpace < minSpace)
      return _filt(splits.slice().reverse(), sc.distr, re, ceil(minSpace / magSpace)).reverse();
  }
  return _filt(splits, sc.distr, re, 1);
}
function log2AxisValsFilt(self, splits, axisIdx, foundSpace, foundIncr) {
  let axis = self.axes[axisIdx];
  let scaleKey = axis.scale;
  let minSpace = axis._space;
  let valToPos = self.valToPos;
  let magSpace = abs(valToPos(1, scaleKey) - valToPos(2, scaleKey));
  if (magSpace < minSpace)
    return _filt(splits.slice().reverse(), 3, RE_ALL, ceil(minSpace / magSpace)).reverse();
  return splits;
}
function numSeriesVal(self, val, seriesIdx, dataIdx) {
  return dataIdx == null ? LEGEND_DISP : val == null ? "" : fmtNum(val);
}
var yAxisOpts = {
  show: true,
  scale: "y",
  stroke: hexBlack,
  space: 30,
  gap: 5,
  alignTo: 1,
  size: 50,
  labelGap: 0,
  labelSize: 30,
  labelFont,
  side: 3,
  //	class: "y-vals",
  //	incrs: numIncrs,
  //	values: (vals, space) => vals,
  //	filter: retArg1,
  grid,
  ticks,
  border,
  font,
  lineGap,
  rotate: 0
};
function ptDia(width, mult) {
  let dia = 3 + (width || 1) * 2;
  return roundDec(dia * mult, 3);
}
function seriesPointsShow(self, si) {
  let { scale, idxs } = self.series[0];
  let xData = self._data[0];
  let p0 = self.valToPos(xData[idxs[0]], scale, true);
  let p1 = self.valToPos(xData[idxs[1]], scale, true);
  let dim = abs(p1 - p0);
  let s4 = self.series[si];
  let maxPts = dim / (s4.points.space * pxRatio);
  return idxs[1] - idxs[0] <= maxPts;
}
var facet = {
  scale: null,
  auto: true,
  sorted: 0,
  // internal caches
  min: inf,
  max: -inf
};
var gaps = (self, seriesIdx, idx0, idx1, nullGaps) => nullGaps;
var xySeriesOpts = {
  show: true,
  auto: true,
  sorted: 0,
  gaps,
  alpha: 1,
  facets: [
    assign({}, facet, { scale: "x" }),
    assign({}, facet, { scale: "y" })
  ]
};
var ySeriesOpts = {
  scale: "y",
  auto: true,
  sorted: 0,
  show: true,
  spanGaps: false,
  gaps,
  alpha: 1,
  points: {
    show: seriesPointsShow,
    filter: null
    //  paths:
    //	stroke: "#000",
    //	fill: "#fff",
    //	width: 1,
    //	size: 10,
  },
  //	label: "Value",
  //	value: v => v,
  values: null,
  // internal caches
  min: inf,
  max: -inf,
  idxs: [],
  path: null,
  clip: null
};
function clampScale(self, val, scaleMin, scaleMax, scaleKey) {
  return scaleMin / 10;
}
var xScaleOpts = {
  time: FEAT_TIME,
  auto: true,
  distr: 1,
  log: 10,
  asinh: 1,
  min: null,
  max: null,
  dir: 1,
  ori: 0
};
var yScaleOpts = assign({}, xScaleOpts, {
  time: false,
  ori: 1
});
var syncs = {};
function _sync(key, opts) {
  let s4 = syncs[key];
  if (!s4) {
    s4 = {
      key,
      plots: [],
      sub(plot) {
        s4.plots.push(plot);
      },
      unsub(plot) {
        s4.plots = s4.plots.filter((c4) => c4 != plot);
      },
      pub(type, self, x3, y5, w5, h5, i4) {
        for (let j3 = 0; j3 < s4.plots.length; j3++)
          s4.plots[j3] != self && s4.plots[j3].pub(type, self, x3, y5, w5, h5, i4);
      }
    };
    if (key != null)
      syncs[key] = s4;
  }
  return s4;
}
var BAND_CLIP_FILL = 1 << 0;
var BAND_CLIP_STROKE = 1 << 1;
function orient(u4, seriesIdx, cb) {
  const mode = u4.mode;
  const series = u4.series[seriesIdx];
  const data = mode == 2 ? u4._data[seriesIdx] : u4._data;
  const scales = u4.scales;
  const bbox = u4.bbox;
  let dx = data[0], dy = mode == 2 ? data[1] : data[seriesIdx], sx = mode == 2 ? scales[series.facets[0].scale] : scales[u4.series[0].scale], sy = mode == 2 ? scales[series.facets[1].scale] : scales[series.scale], l4 = bbox.left, t4 = bbox.top, w5 = bbox.width, h5 = bbox.height, H2 = u4.valToPosH, V2 = u4.valToPosV;
  return sx.ori == 0 ? cb(
    series,
    dx,
    dy,
    sx,
    sy,
    H2,
    V2,
    l4,
    t4,
    w5,
    h5,
    moveToH,
    lineToH,
    rectH,
    arcH,
    bezierCurveToH
  ) : cb(
    series,
    dx,
    dy,
    sx,
    sy,
    V2,
    H2,
    t4,
    l4,
    h5,
    w5,
    moveToV,
    lineToV,
    rectV,
    arcV,
    bezierCurveToV
  );
}
function bandFillClipDirs(self, seriesIdx) {
  let fillDir = 0;
  let clipDirs = 0;
  let bands = ifNull(self.bands, EMPTY_ARR);
  for (let i4 = 0; i4 < bands.length; i4++) {
    let b3 = bands[i4];
    if (b3.series[0] == seriesIdx)
      fillDir = b3.dir;
    else if (b3.series[1] == seriesIdx) {
      if (b3.dir == 1)
        clipDirs |= 1;
      else
        clipDirs |= 2;
    }
  }
  return [
    fillDir,
    clipDirs == 1 ? -1 : (
      // neg only
      clipDirs == 2 ? 1 : (
        // pos only
        clipDirs == 3 ? 2 : (
          // both
          0
        )
      )
    )
  ];
}
function seriesFillTo(self, seriesIdx, dataMin, dataMax, bandFillDir) {
  let mode = self.mode;
  let series = self.series[seriesIdx];
  let scaleKey = mode == 2 ? series.facets[1].scale : series.scale;
  let scale = self.scales[scaleKey];
  return bandFillDir == -1 ? scale.min : bandFillDir == 1 ? scale.max : scale.distr == 3 ? scale.dir == 1 ? scale.min : scale.max : 0;
}
function clipBandLine(self, seriesIdx, idx0, idx1, strokePath, clipDir) {
  return orient(self, seriesIdx, (series, dataX, dataY, scaleX, scaleY, valToPosX, valToPosY, xOff, yOff, xDim, yDim) => {
    let pxRound = series.pxRound;
    const dir = scaleX.dir * (scaleX.ori == 0 ? 1 : -1);
    const lineTo = scaleX.ori == 0 ? lineToH : lineToV;
    let frIdx, toIdx;
    if (dir == 1) {
      frIdx = idx0;
      toIdx = idx1;
    } else {
      frIdx = idx1;
      toIdx = idx0;
    }
    let x0 = pxRound(valToPosX(dataX[frIdx], scaleX, xDim, xOff));
    let y0 = pxRound(valToPosY(dataY[frIdx], scaleY, yDim, yOff));
    let x1 = pxRound(valToPosX(dataX[toIdx], scaleX, xDim, xOff));
    let yLimit = pxRound(valToPosY(clipDir == 1 ? scaleY.max : scaleY.min, scaleY, yDim, yOff));
    let clip = new Path2D(strokePath);
    lineTo(clip, x1, yLimit);
    lineTo(clip, x0, yLimit);
    lineTo(clip, x0, y0);
    return clip;
  });
}
function clipGaps(gaps2, ori, plotLft, plotTop, plotWid, plotHgt) {
  let clip = null;
  if (gaps2.length > 0) {
    clip = new Path2D();
    const rect2 = ori == 0 ? rectH : rectV;
    let prevGapEnd = plotLft;
    for (let i4 = 0; i4 < gaps2.length; i4++) {
      let g5 = gaps2[i4];
      if (g5[1] > g5[0]) {
        let w6 = g5[0] - prevGapEnd;
        w6 > 0 && rect2(clip, prevGapEnd, plotTop, w6, plotTop + plotHgt);
        prevGapEnd = g5[1];
      }
    }
    let w5 = plotLft + plotWid - prevGapEnd;
    let maxStrokeWidth = 10;
    w5 > 0 && rect2(clip, prevGapEnd, plotTop - maxStrokeWidth / 2, w5, plotTop + plotHgt + maxStrokeWidth);
  }
  return clip;
}
function addGap(gaps2, fromX, toX) {
  let prevGap = gaps2[gaps2.length - 1];
  if (prevGap && prevGap[0] == fromX)
    prevGap[1] = toX;
  else
    gaps2.push([fromX, toX]);
}
function findGaps(xs, ys, idx0, idx1, dir, pixelForX, align) {
  let gaps2 = [];
  let len = xs.length;
  for (let i4 = dir == 1 ? idx0 : idx1; i4 >= idx0 && i4 <= idx1; i4 += dir) {
    let yVal = ys[i4];
    if (yVal === null) {
      let fr = i4, to = i4;
      if (dir == 1) {
        while (++i4 <= idx1 && ys[i4] === null)
          to = i4;
      } else {
        while (--i4 >= idx0 && ys[i4] === null)
          to = i4;
      }
      let frPx = pixelForX(xs[fr]);
      let toPx = to == fr ? frPx : pixelForX(xs[to]);
      let fri2 = fr - dir;
      let frPx2 = align <= 0 && fri2 >= 0 && fri2 < len ? pixelForX(xs[fri2]) : frPx;
      frPx = frPx2;
      let toi2 = to + dir;
      let toPx2 = align >= 0 && toi2 >= 0 && toi2 < len ? pixelForX(xs[toi2]) : toPx;
      toPx = toPx2;
      if (toPx >= frPx)
        gaps2.push([frPx, toPx]);
    }
  }
  return gaps2;
}
function pxRoundGen(pxAlign) {
  return pxAlign == 0 ? retArg0 : pxAlign == 1 ? round : (v4) => incrRound(v4, pxAlign);
}
function rect(ori) {
  let moveTo = ori == 0 ? moveToH : moveToV;
  let arcTo = ori == 0 ? (p5, x1, y1, x22, y22, r4) => {
    p5.arcTo(x1, y1, x22, y22, r4);
  } : (p5, y1, x1, y22, x22, r4) => {
    p5.arcTo(x1, y1, x22, y22, r4);
  };
  let rect2 = ori == 0 ? (p5, x3, y5, w5, h5) => {
    p5.rect(x3, y5, w5, h5);
  } : (p5, y5, x3, h5, w5) => {
    p5.rect(x3, y5, w5, h5);
  };
  return (p5, x3, y5, w5, h5, endRad = 0, baseRad = 0) => {
    if (endRad == 0 && baseRad == 0)
      rect2(p5, x3, y5, w5, h5);
    else {
      endRad = min(endRad, w5 / 2, h5 / 2);
      baseRad = min(baseRad, w5 / 2, h5 / 2);
      moveTo(p5, x3 + endRad, y5);
      arcTo(p5, x3 + w5, y5, x3 + w5, y5 + h5, endRad);
      arcTo(p5, x3 + w5, y5 + h5, x3, y5 + h5, baseRad);
      arcTo(p5, x3, y5 + h5, x3, y5, baseRad);
      arcTo(p5, x3, y5, x3 + w5, y5, endRad);
      p5.closePath();
    }
  };
}
var moveToH = (p5, x3, y5) => {
  p5.moveTo(x3, y5);
};
var moveToV = (p5, y5, x3) => {
  p5.moveTo(x3, y5);
};
var lineToH = (p5, x3, y5) => {
  p5.lineTo(x3, y5);
};
var lineToV = (p5, y5, x3) => {
  p5.lineTo(x3, y5);
};
var rectH = rect(0);
var rectV = rect(1);
var arcH = (p5, x3, y5, r4, startAngle, endAngle) => {
  p5.arc(x3, y5, r4, startAngle, endAngle);
};
var arcV = (p5, y5, x3, r4, startAngle, endAngle) => {
  p5.arc(x3, y5, r4, startAngle, endAngle);
};
var bezierCurveToH = (p5, bp1x, bp1y, bp2x, bp2y, p2x, p2y) => {
  p5.bezierCurveTo(bp1x, bp1y, bp2x, bp2y, p2x, p2y);
};
var bezierCurveToV = (p5, bp1y, bp1x, bp2y, bp2x, p2y, p2x) => {
  p5.bezierCurveTo(bp1x, bp1y, bp2x, bp2y, p2x, p2y);
};
function points(opts) {
  return (u4, seriesIdx, idx0, idx1, filtIdxs) => {
    return orient(u4, seriesIdx, (series, dataX, dataY, scaleX, scaleY, valToPosX, valToPosY, xOff, yOff, xDim, yDim) => {
      let { pxRound, points: points2 } = series;
      let moveTo, arc;
      if (scaleX.ori == 0) {
        moveTo = moveToH;
        arc = arcH;
      } else {
        moveTo = moveToV;
        arc = arcV;
      }
      const width = roundDec(points2.width * pxRatio, 3);
      let rad = (points2.size - points2.width) / 2 * pxRatio;
      let dia = roundDec(rad * 2, 3);
      let fill = new Path2D();
      let clip = new Path2D();
      let { left: lft, top, width: wid, height: hgt } = u4.bbox;
      rectH(
        clip,
        lft - dia,
        top - dia,
        wid + dia * 2,
        hgt + dia * 2
      );
      const drawPoint = (pi) => {
        if (dataY[pi] != null) {
          let x3 = pxRound(valToPosX(dataX[pi], scaleX, xDim, xOff));
          let y5 = pxRound(valToPosY(dataY[pi], scaleY, yDim, yOff));
          moveTo(fill, x3 + rad, y5);
          arc(fill, x3, y5, rad, 0, PI * 2);
        }
      };
      if (filtIdxs)
        filtIdxs.forEach(drawPoint);
      else {
        for (let pi = idx0; pi <= idx1; pi++)
          drawPoint(pi);
      }
      return {
        stroke: width > 0 ? fill : null,
        fill,
        clip,
        flags: BAND_CLIP_FILL | BAND_CLIP_STROKE
      };
    });
  };
}
function _drawAcc(lineTo) {
  return (stroke, accX, minY, maxY, inY, outY) => {
    if (minY != maxY) {
      if (inY != minY && outY != minY)
        lineTo(stroke, accX, minY);
      if (inY != maxY && outY != maxY)
        lineTo(stroke, accX, maxY);
      lineTo(stroke, accX, outY);
    }
  };
}
var drawAccH = _drawAcc(lineToH);
var drawAccV = _drawAcc(lineToV);
function linear(opts) {
  const alignGaps = ifNull(opts?.alignGaps, 0);
  return (u4, seriesIdx, idx0, idx1) => {
    return orient(u4, seriesIdx, (series, dataX, dataY, scaleX, scaleY, valToPosX, valToPosY, xOff, yOff, xDim, yDim) => {
      [idx0, idx1] = nonNullIdxs(dataY, idx0, idx1);
      let pxRound = series.pxRound;
      let pixelForX = (val) => pxRound(valToPosX(val, scaleX, xDim, xOff));
      let pixelForY = (val) => pxRound(valToPosY(val, scaleY, yDim, yOff));
      let lineTo, drawAcc;
      if (scaleX.ori == 0) {
        lineTo = lineToH;
        drawAcc = drawAccH;
      } else {
        lineTo = lineToV;
        drawAcc = drawAccV;
      }
      const dir = scaleX.dir * (scaleX.ori == 0 ? 1 : -1);
      const _paths = { stroke: new Path2D(), fill: null, clip: null, band: null, gaps: null, flags: BAND_CLIP_FILL };
      const stroke = _paths.stroke;
      let hasGap = false;
      const decimate = idx1 - idx0 >= xDim * 4;
      if (decimate) {
        let xForPixel = (pos) => u4.posToVal(pos, scaleX.key, true);
        let minY = null, maxY = null, inY, outY, drawnAtX;
        let accX = pixelForX(dataX[dir == 1 ? idx0 : idx1]);
        let idx0px = pixelForX(dataX[idx0]);
        let idx1px = pixelForX(dataX[idx1]);
        let nextAccXVal = xForPixel(dir == 1 ? idx0px + 1 : idx1px - 1);
        for (let i4 = dir == 1 ? idx0 : idx1; i4 >= idx0 && i4 <= idx1; i4 += dir) {
          let xVal = dataX[i4];
          let reuseAccX = dir == 1 ? xVal < nextAccXVal : xVal > nextAccXVal;
          let x3 = reuseAccX ? accX : pixelForX(xVal);
          let yVal = dataY[i4];
          if (x3 == accX) {
            if (yVal != null) {
              outY = yVal;
              if (minY == null) {
                lineTo(stroke, x3, pixelForY(outY));
                inY = minY = maxY = outY;
              } else {
                if (outY < minY)
                  minY = outY;
                else if (outY > maxY)
                  maxY = outY;
              }
            } else {
              if (yVal === null)
                hasGap = true;
            }
          } else {
            if (minY != null)
              drawAcc(stroke, accX, pixelForY(minY), pixelForY(maxY), pixelForY(inY), pixelForY(outY));
            if (yVal != null) {
              outY = yVal;
              lineTo(stroke, x3, pixelForY(outY));
              minY = maxY = inY = outY;
            } else {
              minY = maxY = null;
              if (yVal === null)
                hasGap = true;
            }
            accX = x3;
            nextAccXVal = xForPixel(accX + dir);
          }
        }
        if (minY != null && minY != maxY && drawnAtX != accX)
          drawAcc(stroke, accX, pixelForY(minY), pixelForY(maxY), pixelForY(inY), pixelForY(outY));
      } else {
        for (let i4 = dir == 1 ? idx0 : idx1; i4 >= idx0 && i4 <= idx1; i4 += dir) {
          let yVal = dataY[i4];
          if (yVal === null)
            hasGap = true;
          else if (yVal != null)
            lineTo(stroke, pixelForX(dataX[i4]), pixelForY(yVal));
        }
      }
      let [bandFillDir, bandClipDir] = bandFillClipDirs(u4, seriesIdx);
      if (series.fill != null || bandFillDir != 0) {
        let fill = _paths.fill = new Path2D(stroke);
        let fillToVal = series.fillTo(u4, seriesIdx, series.min, series.max, bandFillDir);
        let fillToY = pixelForY(fillToVal);
        let frX = pixelForX(dataX[idx0]);
        let toX = pixelForX(dataX[idx1]);
        if (dir == -1)
          [toX, frX] = [frX, toX];
        lineTo(fill, toX, fillToY);
        lineTo(fill, frX, fillToY);
      }
      if (!series.spanGaps) {
        let gaps2 = [];
        hasGap && gaps2.push(...findGaps(dataX, dataY, idx0, idx1, dir, pixelForX, alignGaps));
        _paths.gaps = gaps2 = series.gaps(u4, seriesIdx, idx0, idx1, gaps2);
        _paths.clip = clipGaps(gaps2, scaleX.ori, xOff, yOff, xDim, yDim);
      }
      if (bandClipDir != 0) {
        _paths.band = bandClipDir == 2 ? [
          clipBandLine(u4, seriesIdx, idx0, idx1, stroke, -1),
          clipBandLine(u4, seriesIdx, idx0, idx1, stroke, 1)
        ] : clipBandLine(u4, seriesIdx, idx0, idx1, stroke, bandClipDir);
      }
      return _paths;
    });
  };
}
function stepped(opts) {
  const align = ifNull(opts.align, 1);
  const ascDesc = ifNull(opts.ascDesc, false);
  const alignGaps = ifNull(opts.alignGaps, 0);
  const extend = ifNull(opts.extend, false);
  return (u4, seriesIdx, idx0, idx1) => {
    return orient(u4, seriesIdx, (series, dataX, dataY, scaleX, scaleY, valToPosX, valToPosY, xOff, yOff, xDim, yDim) => {
      [idx0, idx1] = nonNullIdxs(dataY, idx0, idx1);
      let pxRound = series.pxRound;
      let { left, width } = u4.bbox;
      let pixelForX = (val) => pxRound(valToPosX(val, scaleX, xDim, xOff));
      let pixelForY = (val) => pxRound(valToPosY(val, scaleY, yDim, yOff));
      let lineTo = scaleX.ori == 0 ? lineToH : lineToV;
      const _paths = { stroke: new Path2D(), fill: null, clip: null, band: null, gaps: null, flags: BAND_CLIP_FILL };
      const stroke = _paths.stroke;
      const dir = scaleX.dir * (scaleX.ori == 0 ? 1 : -1);
      let prevYPos = pixelForY(dataY[dir == 1 ? idx0 : idx1]);
      let firstXPos = pixelForX(dataX[dir == 1 ? idx0 : idx1]);
      let prevXPos = firstXPos;
      let firstXPosExt = firstXPos;
      if (extend && align == -1) {
        firstXPosExt = left;
        lineTo(stroke, firstXPosExt, prevYPos);
      }
      lineTo(stroke, firstXPos, prevYPos);
      for (let i4 = dir == 1 ? idx0 : idx1; i4 >= idx0 && i4 <= idx1; i4 += dir) {
        let yVal1 = dataY[i4];
        if (yVal1 == null)
          continue;
        let x1 = pixelForX(dataX[i4]);
        let y1 = pixelForY(yVal1);
        if (align == 1)
          lineTo(stroke, x1, prevYPos);
        else
          lineTo(stroke, prevXPos, y1);
        lineTo(stroke, x1, y1);
        prevYPos = y1;
        prevXPos = x1;
      }
      let prevXPosExt = prevXPos;
      if (extend && align == 1) {
        prevXPosExt = left + width;
        lineTo(stroke, prevXPosExt, prevYPos);
      }
      let [bandFillDir, bandClipDir] = bandFillClipDirs(u4, seriesIdx);
      if (series.fill != null || bandFillDir != 0) {
        let fill = _paths.fill = new Path2D(stroke);
        let fillTo = series.fillTo(u4, seriesIdx, series.min, series.max, bandFillDir);
        let fillToY = pixelForY(fillTo);
        lineTo(fill, prevXPosExt, fillToY);
        lineTo(fill, firstXPosExt, fillToY);
      }
      if (!series.spanGaps) {
        let gaps2 = [];
        gaps2.push(...findGaps(dataX, dataY, idx0, idx1, dir, pixelForX, alignGaps));
        let halfStroke = series.width * pxRatio / 2;
        let startsOffset = ascDesc || align == 1 ? halfStroke : -halfStroke;
        let endsOffset = ascDesc || align == -1 ? -halfStroke : halfStroke;
        gaps2.forEach((g5) => {
          g5[0] += startsOffset;
          g5[1] += endsOffset;
        });
        _paths.gaps = gaps2 = series.gaps(u4, seriesIdx, idx0, idx1, gaps2);
        _paths.clip = clipGaps(gaps2, scaleX.ori, xOff, yOff, xDim, yDim);
      }
      if (bandClipDir != 0) {
        _paths.band = bandClipDir == 2 ? [
          clipBandLine(u4, seriesIdx, idx0, idx1, stroke, -1),
          clipBandLine(u4, seriesIdx, idx0, idx1, stroke, 1)
        ] : clipBandLine(u4, seriesIdx, idx0, idx1, stroke, bandClipDir);
      }
      return _paths;
    });
  };
}
function findColWidth(dataX, dataY, valToPosX, scaleX, xDim, xOff, colWid = inf) {
  if (dataX.length > 1) {
    let prevIdx = null;
    for (let i4 = 0, minDelta = Infinity; i4 < dataX.length; i4++) {
      if (dataY[i4] !== void 0) {
        if (prevIdx != null) {
          let delta = abs(dataX[i4] - dataX[prevIdx]);
          if (delta < minDelta) {
            minDelta = delta;
            colWid = abs(valToPosX(dataX[i4], scaleX, xDim, xOff) - valToPosX(dataX[prevIdx], scaleX, xDim, xOff));
          }
        }
        prevIdx = i4;
      }
    }
  }
  return colWid;
}
function bars(opts) {
  opts = opts || EMPTY_OBJ;
  const size = ifNull(opts.size, [0.6, inf, 1]);
  const align = opts.align || 0;
  const _extraGap = opts.gap || 0;
  let ro = opts.radius;
  ro = // [valueRadius, baselineRadius]
  ro == null ? [0, 0] : typeof ro == "number" ? [ro, 0] : ro;
  const radiusFn = fnOrSelf(ro);
  const gapFactor = 1 - size[0];
  const _maxWidth = ifNull(size[1], inf);
  const _minWidth = ifNull(size[2], 1);
  const disp = ifNull(opts.disp, EMPTY_OBJ);
  const _each = ifNull(opts.each, (_5) => {
  });
  const { fill: dispFills, stroke: dispStrokes } = disp;
  return (u4, seriesIdx, idx0, idx1) => {
    return orient(u4, seriesIdx, (series, dataX, dataY, scaleX, scaleY, valToPosX, valToPosY, xOff, yOff, xDim, yDim) => {
      let pxRound = series.pxRound;
      let _align = align;
      let extraGap = _extraGap * pxRatio;
      let maxWidth = _maxWidth * pxRatio;
      let minWidth = _minWidth * pxRatio;
      let valRadius, baseRadius;
      if (scaleX.ori == 0)
        [valRadius, baseRadius] = radiusFn(u4, seriesIdx);
      else
        [baseRadius, valRadius] = radiusFn(u4, seriesIdx);
      const _dirX = scaleX.dir * (scaleX.ori == 0 ? 1 : -1);
      let rect2 = scaleX.ori == 0 ? rectH : rectV;
      let each = scaleX.ori == 0 ? _each : (u5, seriesIdx2, i4, top, lft, hgt, wid) => {
        _each(u5, seriesIdx2, i4, lft, top, wid, hgt);
      };
      let band = ifNull(u4.bands, EMPTY_ARR).find((b3) => b3.series[0] == seriesIdx);
      let fillDir = band != null ? band.dir : 0;
      let fillTo = series.fillTo(u4, seriesIdx, series.min, series.max, fillDir);
      let fillToY = pxRound(valToPosY(fillTo, scaleY, yDim, yOff));
      let xShift, barWid, fullGap, colWid = xDim;
      let strokeWidth = pxRound(series.width * pxRatio);
      let multiPath = false;
      let fillColors = null;
      let fillPaths = null;
      let strokeColors = null;
      let strokePaths = null;
      if (dispFills != null && (strokeWidth == 0 || dispStrokes != null)) {
        multiPath = true;
        fillColors = dispFills.values(u4, seriesIdx, idx0, idx1);
        fillPaths = /* @__PURE__ */ new Map();
        new Set(fillColors).forEach((color) => {
          if (color != null)
            fillPaths.set(color, new Path2D());
        });
        if (strokeWidth > 0) {
          strokeColors = dispStrokes.values(u4, seriesIdx, idx0, idx1);
          strokePaths = /* @__PURE__ */ new Map();
          new Set(strokeColors).forEach((color) => {
            if (color != null)
              strokePaths.set(color, new Path2D());
          });
        }
      }
      let { x0, size: size2 } = disp;
      if (x0 != null && size2 != null) {
        _align = 1;
        dataX = x0.values(u4, seriesIdx, idx0, idx1);
        if (x0.unit == 2)
          dataX = dataX.map((pct) => u4.posToVal(xOff + pct * xDim, scaleX.key, true));
        let sizes = size2.values(u4, seriesIdx, idx0, idx1);
        if (size2.unit == 2)
          barWid = sizes[0] * xDim;
        else
          barWid = valToPosX(sizes[0], scaleX, xDim, xOff) - valToPosX(0, scaleX, xDim, xOff);
        colWid = findColWidth(dataX, dataY, valToPosX, scaleX, xDim, xOff, colWid);
        let gapWid = colWid - barWid;
        fullGap = gapWid + extraGap;
      } else {
        colWid = findColWidth(dataX, dataY, valToPosX, scaleX, xDim, xOff, colWid);
        let gapWid = colWid * gapFactor;
        fullGap = gapWid + extraGap;
        barWid = colWid - fullGap;
      }
      if (fullGap < 1)
        fullGap = 0;
      if (strokeWidth >= barWid / 2)
        strokeWidth = 0;
      if (fullGap < 5)
        pxRound = retArg0;
      let insetStroke = fullGap > 0;
      let rawBarWid = colWid - fullGap - (insetStroke ? strokeWidth : 0);
      barWid = pxRound(clamp(rawBarWid, minWidth, maxWidth));
      xShift = (_align == 0 ? barWid / 2 : _align == _dirX ? 0 : barWid) - _align * _dirX * ((_align == 0 ? extraGap / 2 : 0) + (insetStroke ? strokeWidth / 2 : 0));
      const _paths = { stroke: null, fill: null, clip: null, band: null, gaps: null, flags: 0 };
      const stroke = multiPath ? null : new Path2D();
      let dataY0 = null;
      if (band != null)
        dataY0 = u4.data[band.series[1]];
      else {
        let { y0, y1 } = disp;
        if (y0 != null && y1 != null) {
          dataY = y1.values(u4, seriesIdx, idx0, idx1);
          dataY0 = y0.values(u4, seriesIdx, idx0, idx1);
        }
      }
      let radVal = valRadius * barWid;
      let radBase = baseRadius * barWid;
      for (let i4 = _dirX == 1 ? idx0 : idx1; i4 >= idx0 && i4 <= idx1; i4 += _dirX) {
        let yVal = dataY[i4];
        if (yVal == null)
          continue;
        if (dataY0 != null) {
          let yVal0 = dataY0[i4] ?? 0;
          if (yVal - yVal0 == 0)
            continue;
          fillToY = valToPosY(yVal0, scaleY, yDim, yOff);
        }
        let xVal = scaleX.distr != 2 || disp != null ? dataX[i4] : i4;
        let xPos = valToPosX(xVal, scaleX, xDim, xOff);
        let yPos = valToPosY(ifNull(yVal, fillTo), scaleY, yDim, yOff);
        let lft = pxRound(xPos - xShift);
        let btm = pxRound(max(yPos, fillToY));
        let top = pxRound(min(yPos, fillToY));
        let barHgt = btm - top;
        if (yVal != null) {
          let rv = yVal < 0 ? radBase : radVal;
          let rb = yVal < 0 ? radVal : radBase;
          if (multiPath) {
            if (strokeWidth > 0 && strokeColors[i4] != null)
              rect2(strokePaths.get(strokeColors[i4]), lft, top + floor(strokeWidth / 2), barWid, max(0, barHgt - strokeWidth), rv, rb);
            if (fillColors[i4] != null)
              rect2(fillPaths.get(fillColors[i4]), lft, top + floor(strokeWidth / 2), barWid, max(0, barHgt - strokeWidth), rv, rb);
          } else
            rect2(stroke, lft, top + floor(strokeWidth / 2), barWid, max(0, barHgt - strokeWidth), rv, rb);
          each(
            u4,
            seriesIdx,
            i4,
            lft - strokeWidth / 2,
            top,
            barWid + strokeWidth,
            barHgt
          );
        }
      }
      if (strokeWidth > 0)
        _paths.stroke = multiPath ? strokePaths : stroke;
      else if (!multiPath) {
        _paths._fill = series.width == 0 ? series._fill : series._stroke ?? series._fill;
        _paths.width = 0;
      }
      _paths.fill = multiPath ? fillPaths : stroke;
      return _paths;
    });
  };
}
function splineInterp(interp, opts) {
  const alignGaps = ifNull(opts?.alignGaps, 0);
  return (u4, seriesIdx, idx0, idx1) => {
    return orient(u4, seriesIdx, (series, dataX, dataY, scaleX, scaleY, valToPosX, valToPosY, xOff, yOff, xDim, yDim) => {
      [idx0, idx1] = nonNullIdxs(dataY, idx0, idx1);
      let pxRound = series.pxRound;
      let pixelForX = (val) => pxRound(valToPosX(val, scaleX, xDim, xOff));
      let pixelForY = (val) => pxRound(valToPosY(val, scaleY, yDim, yOff));
      let moveTo, bezierCurveTo, lineTo;
      if (scaleX.ori == 0) {
        moveTo = moveToH;
        lineTo = lineToH;
        bezierCurveTo = bezierCurveToH;
      } else {
        moveTo = moveToV;
        lineTo = lineToV;
        bezierCurveTo = bezierCurveToV;
      }
      const dir = scaleX.dir * (scaleX.ori == 0 ? 1 : -1);
      let firstXPos = pixelForX(dataX[dir == 1 ? idx0 : idx1]);
      let prevXPos = firstXPos;
      let xCoords = [];
      let yCoords = [];
      for (let i4 = dir == 1 ? idx0 : idx1; i4 >= idx0 && i4 <= idx1; i4 += dir) {
        let yVal = dataY[i4];
        if (yVal != null) {
          let xVal = dataX[i4];
          let xPos = pixelForX(xVal);
          xCoords.push(prevXPos = xPos);
          yCoords.push(pixelForY(dataY[i4]));
        }
      }
      const _paths = { stroke: interp(xCoords, yCoords, moveTo, lineTo, bezierCurveTo, pxRound), fill: null, clip: null, band: null, gaps: null, flags: BAND_CLIP_FILL };
      const stroke = _paths.stroke;
      let [bandFillDir, bandClipDir] = bandFillClipDirs(u4, seriesIdx);
      if (series.fill != null || bandFillDir != 0) {
        let fill = _paths.fill = new Path2D(stroke);
        let fillTo = series.fillTo(u4, seriesIdx, series.min, series.max, bandFillDir);
        let fillToY = pixelForY(fillTo);
        lineTo(fill, prevXPos, fillToY);
        lineTo(fill, firstXPos, fillToY);
      }
      if (!series.spanGaps) {
        let gaps2 = [];
        gaps2.push(...findGaps(dataX, dataY, idx0, idx1, dir, pixelForX, alignGaps));
        _paths.gaps = gaps2 = series.gaps(u4, seriesIdx, idx0, idx1, gaps2);
        _paths.clip = clipGaps(gaps2, scaleX.ori, xOff, yOff, xDim, yDim);
      }
      if (bandClipDir != 0) {
        _paths.band = bandClipDir == 2 ? [
          clipBandLine(u4, seriesIdx, idx0, idx1, stroke, -1),
          clipBandLine(u4, seriesIdx, idx0, idx1, stroke, 1)
        ] : clipBandLine(u4, seriesIdx, idx0, idx1, stroke, bandClipDir);
      }
      return _paths;
    });
  };
}
function monotoneCubic(opts) {
  return splineInterp(_monotoneCubic, opts);
}
function _monotoneCubic(xs, ys, moveTo, lineTo, bezierCurveTo, pxRound) {
  const n3 = xs.length;
  if (n3 < 2)
    return null;
  const path = new Path2D();
  moveTo(path, xs[0], ys[0]);
  if (n3 == 2)
    lineTo(path, xs[1], ys[1]);
  else {
    let ms2 = Array(n3), ds = Array(n3 - 1), dys = Array(n3 - 1), dxs = Array(n3 - 1);
    for (let i4 = 0; i4 < n3 - 1; i4++) {
      dys[i4] = ys[i4 + 1] - ys[i4];
      dxs[i4] = xs[i4 + 1] - xs[i4];
      ds[i4] = dys[i4] / dxs[i4];
    }
    ms2[0] = ds[0];
    for (let i4 = 1; i4 < n3 - 1; i4++) {
      if (ds[i4] === 0 || ds[i4 - 1] === 0 || ds[i4 - 1] > 0 !== ds[i4] > 0)
        ms2[i4] = 0;
      else {
        ms2[i4] = 3 * (dxs[i4 - 1] + dxs[i4]) / ((2 * dxs[i4] + dxs[i4 - 1]) / ds[i4 - 1] + (dxs[i4] + 2 * dxs[i4 - 1]) / ds[i4]);
        if (!isFinite(ms2[i4]))
          ms2[i4] = 0;
      }
    }
    ms2[n3 - 1] = ds[n3 - 2];
    for (let i4 = 0; i4 < n3 - 1; i4++) {
      bezierCurveTo(
        path,
        xs[i4] + dxs[i4] / 3,
        ys[i4] + ms2[i4] * dxs[i4] / 3,
        xs[i4 + 1] - dxs[i4] / 3,
        ys[i4 + 1] - ms2[i4 + 1] * dxs[i4] / 3,
        xs[i4 + 1],
        ys[i4 + 1]
      );
    }
  }
  return path;
}
var cursorPlots = /* @__PURE__ */ new Set();
function invalidateRects() {
  for (let u4 of cursorPlots)
    u4.syncRect(true);
}
if (domEnv) {
  on(resize, win, invalidateRects);
  on(scroll, win, invalidateRects, true);
  on(dppxchange, win, () => {
    uPlot.pxRatio = pxRatio;
  });
}
var linearPath = linear();
var pointsPath = points();
function setDefaults(d5, xo, yo, initY) {
  let d22 = initY ? [d5[0], d5[1]].concat(d5.slice(2)) : [d5[0]].concat(d5.slice(1));
  return d22.map((o5, i4) => setDefault(o5, i4, xo, yo));
}
function setDefaults2(d5, xyo) {
  return d5.map((o5, i4) => i4 == 0 ? {} : assign({}, xyo, o5));
}
function setDefault(o5, i4, xo, yo) {
  return assign({}, i4 == 0 ? xo : yo, o5);
}
function snapNumX(self, dataMin, dataMax) {
  return dataMin == null ? nullNullTuple : [dataMin, dataMax];
}
var snapTimeX = snapNumX;
function snapNumY(self, dataMin, dataMax) {
  return dataMin == null ? nullNullTuple : rangeNum(dataMin, dataMax, rangePad, true);
}
function snapLogY(self, dataMin, dataMax, scale) {
  return dataMin == null ? nullNullTuple : rangeLog(dataMin, dataMax, self.scales[scale].log, false);
}
var snapLogX = snapLogY;
function snapAsinhY(self, dataMin, dataMax, scale) {
  return dataMin == null ? nullNullTuple : rangeAsinh(dataMin, dataMax, self.scales[scale].log, false);
}
var snapAsinhX = snapAsinhY;
function findIncr(minVal, maxVal, incrs, dim, minSpace) {
  let intDigits = max(numIntDigits(minVal), numIntDigits(maxVal));
  let delta = maxVal - minVal;
  let incrIdx = closestIdx(minSpace / dim * delta, incrs);
  do {
    let foundIncr = incrs[incrIdx];
    let foundSpace = dim * foundIncr / delta;
    if (foundSpace >= minSpace && intDigits + (foundIncr < 5 ? fixedDec.get(foundIncr) : 0) <= 17)
      return [foundIncr, foundSpace];
  } while (++incrIdx < incrs.length);
  return [0, 0];
}
function pxRatioFont(font2) {
  let fontSize, fontSizeCss;
  font2 = font2.replace(/(\d+)px/, (m5, p1) => (fontSize = round((fontSizeCss = +p1) * pxRatio)) + "px");
  return [font2, fontSize, fontSizeCss];
}
function syncFontSize(axis) {
  if (axis.show) {
    [axis.font, axis.labelFont].forEach((f5) => {
      let size = roundDec(f5[2] * pxRatio, 1);
      f5[0] = f5[0].replace(/[0-9.]+px/, size + "px");
      f5[1] = size;
    });
  }
}
function uPlot(opts, data, then) {
  const self = {
    mode: ifNull(opts.mode, 1)
  };
  const mode = self.mode;
  function getHPos(val, scale, dim, off2) {
    let pct = scale.valToPct(val);
    return off2 + dim * (scale.dir == -1 ? 1 - pct : pct);
  }
  function getVPos(val, scale, dim, off2) {
    let pct = scale.valToPct(val);
    return off2 + dim * (scale.dir == -1 ? pct : 1 - pct);
  }
  function getPos(val, scale, dim, off2) {
    return scale.ori == 0 ? getHPos(val, scale, dim, off2) : getVPos(val, scale, dim, off2);
  }
  self.valToPosH = getHPos;
  self.valToPosV = getVPos;
  let ready = false;
  self.status = 0;
  const root = self.root = placeDiv(UPLOT);
  if (opts.id != null)
    root.id = opts.id;
  addClass(root, opts.class);
  if (opts.title) {
    let title = placeDiv(TITLE, root);
    title.textContent = opts.title;
  }
  const can = placeTag("canvas");
  const ctx = self.ctx = can.getContext("2d");
  const wrap = placeDiv(WRAP, root);
  on("click", wrap, (e4) => {
    if (e4.target === over) {
      let didDrag = mouseLeft1 != mouseLeft0 || mouseTop1 != mouseTop0;
      didDrag && drag2.click(self, e4);
    }
  }, true);
  const under = self.under = placeDiv(UNDER, wrap);
  wrap.appendChild(can);
  const over = self.over = placeDiv(OVER, wrap);
  opts = copy(opts);
  const pxAlign = +ifNull(opts.pxAlign, 1);
  const pxRound = pxRoundGen(pxAlign);
  (opts.plugins || []).forEach((p5) => {
    if (p5.opts)
      opts = p5.opts(self, opts) || opts;
  });
  const ms2 = opts.ms || 1e-3;
  const series = self.series = mode == 1 ? setDefaults(opts.series || [], xSeriesOpts, ySeriesOpts, false) : setDefaults2(opts.series || [null], xySeriesOpts);
  const axes = self.axes = setDefaults(opts.axes || [], xAxisOpts, yAxisOpts, true);
  const scales = self.scales = {};
  const bands = self.bands = opts.bands || [];
  bands.forEach((b3) => {
    b3.fill = fnOrSelf(b3.fill || null);
    b3.dir = ifNull(b3.dir, -1);
  });
  const xScaleKey = mode == 2 ? series[1].facets[0].scale : series[0].scale;
  const drawOrderMap = {
    axes: drawAxesGrid,
    series: drawSeries
  };
  const drawOrder = (opts.drawOrder || ["axes", "series"]).map((key2) => drawOrderMap[key2]);
  function initValToPct(sc) {
    const getVal = sc.distr == 3 ? (val) => log10(val > 0 ? val : sc.clamp(self, val, sc.min, sc.max, sc.key)) : sc.distr == 4 ? (val) => asinh(val, sc.asinh) : sc.distr == 100 ? (val) => sc.fwd(val) : (val) => val;
    return (val) => {
      let _val = getVal(val);
      let { _min, _max } = sc;
      let delta = _max - _min;
      return (_val - _min) / delta;
    };
  }
  function initScale(scaleKey) {
    let sc = scales[scaleKey];
    if (sc == null) {
      let scaleOpts = (opts.scales || EMPTY_OBJ)[scaleKey] || EMPTY_OBJ;
      if (scaleOpts.from != null) {
        initScale(scaleOpts.from);
        let sc2 = assign({}, scales[scaleOpts.from], scaleOpts, { key: scaleKey });
        sc2.valToPct = initValToPct(sc2);
        scales[scaleKey] = sc2;
      } else {
        sc = scales[scaleKey] = assign({}, scaleKey == xScaleKey ? xScaleOpts : yScaleOpts, scaleOpts);
        sc.key = scaleKey;
        let isTime = sc.time;
        let rn = sc.range;
        let rangeIsArr = isArr(rn);
        if (scaleKey != xScaleKey || mode == 2 && !isTime) {
          if (rangeIsArr && (rn[0] == null || rn[1] == null)) {
            rn = {
              min: rn[0] == null ? autoRangePart : {
                mode: 1,
                hard: rn[0],
                soft: rn[0]
              },
              max: rn[1] == null ? autoRangePart : {
                mode: 1,
                hard: rn[1],
                soft: rn[1]
              }
            };
            rangeIsArr = false;
          }
          if (!rangeIsArr && isObj(rn)) {
            let cfg = rn;
            rn = (self2, dataMin, dataMax) => dataMin == null ? nullNullTuple : rangeNum(dataMin, dataMax, cfg);
          }
        }
        sc.range = fnOrSelf(rn || (isTime ? snapTimeX : scaleKey == xScaleKey ? sc.distr == 3 ? snapLogX : sc.distr == 4 ? snapAsinhX : snapNumX : sc.distr == 3 ? snapLogY : sc.distr == 4 ? snapAsinhY : snapNumY));
        sc.auto = fnOrSelf(rangeIsArr ? false : sc.auto);
        sc.clamp = fnOrSelf(sc.clamp || clampScale);
        sc._min = sc._max = null;
        sc.valToPct = initValToPct(sc);
      }
    }
  }
  initScale("x");
  initScale("y");
  if (mode == 1) {
    series.forEach((s4) => {
      initScale(s4.scale);
    });
  }
  axes.forEach((a5) => {
    initScale(a5.scale);
  });
  for (let k4 in opts.scales)
    initScale(k4);
  const scaleX = scales[xScaleKey];
  const xScaleDistr = scaleX.distr;
  let valToPosX, valToPosY;
  if (scaleX.ori == 0) {
    addClass(root, ORI_HZ);
    valToPosX = getHPos;
    valToPosY = getVPos;
  } else {
    addClass(root, ORI_VT);
    valToPosX = getVPos;
    valToPosY = getHPos;
  }
  const pendScales = {};
  for (let k4 in scales) {
    let sc = scales[k4];
    if (sc.min != null || sc.max != null) {
      pendScales[k4] = { min: sc.min, max: sc.max };
      sc.min = sc.max = null;
    }
  }
  const _tzDate = opts.tzDate || ((ts) => new Date(round(ts / ms2)));
  const _fmtDate = opts.fmtDate || fmtDate;
  const _timeAxisSplits = ms2 == 1 ? timeAxisSplitsMs(_tzDate) : timeAxisSplitsS(_tzDate);
  const _timeAxisVals = timeAxisVals(_tzDate, timeAxisStamps(ms2 == 1 ? _timeAxisStampsMs : _timeAxisStampsS, _fmtDate));
  const _timeSeriesVal = timeSeriesVal(_tzDate, timeSeriesStamp(_timeSeriesStamp, _fmtDate));
  const activeIdxs = [];
  const legend = self.legend = assign({}, legendOpts, opts.legend);
  const cursor = self.cursor = assign({}, cursorOpts, { drag: { y: mode == 2 } }, opts.cursor);
  const showLegend = legend.show;
  const showCursor = cursor.show;
  const markers = legend.markers;
  {
    legend.idxs = activeIdxs;
    markers.width = fnOrSelf(markers.width);
    markers.dash = fnOrSelf(markers.dash);
    markers.stroke = fnOrSelf(markers.stroke);
    markers.fill = fnOrSelf(markers.fill);
  }
  let legendTable;
  let legendHead;
  let legendBody;
  let legendRows = [];
  let legendCells = [];
  let legendCols;
  let multiValLegend = false;
  let NULL_LEGEND_VALUES = {};
  if (legend.live) {
    const getMultiVals = series[1] ? series[1].values : null;
    multiValLegend = getMultiVals != null;
    legendCols = multiValLegend ? getMultiVals(self, 1, 0) : { _: 0 };
    for (let k4 in legendCols)
      NULL_LEGEND_VALUES[k4] = LEGEND_DISP;
  }
  if (showLegend) {
    legendTable = placeTag("table", LEGEND2, root);
    legendBody = placeTag("tbody", null, legendTable);
    legend.mount(self, legendTable);
    if (multiValLegend) {
      legendHead = placeTag("thead", null, legendTable, legendBody);
      let head2 = placeTag("tr", null, legendHead);
      placeTag("th", null, head2);
      for (var key in legendCols)
        placeTag("th", LEGEND_LABEL, head2).textContent = key;
    } else {
      addClass(legendTable, LEGEND_INLINE);
      legend.live && addClass(legendTable, LEGEND_LIVE);
    }
  }
  const son = { show: true };
  const soff = { show: false };
  function initLegendRow(s4, i4) {
    if (i4 == 0 && (multiValLegend || !legend.live || mode == 2))
      return nullNullTuple;
    let cells = [];
    let row = placeTag("tr", LEGEND_SERIES, legendBody, legendBody.childNodes[i4]);
    addClass(row, s4.class);
    if (!s4.show)
      addClass(row, OFF);
    let label = placeTag("th", null, row);
    if (markers.show) {
      let indic = placeDiv(LEGEND_MARKER, label);
      if (i4 > 0) {
        let width = markers.width(self, i4);
        if (width)
          indic.style.border = width + "px " + markers.dash(self, i4) + " " + markers.stroke(self, i4);
        indic.style.background = markers.fill(self, i4);
      }
    }
    let text2 = placeDiv(LEGEND_LABEL, label);
    if (s4.label instanceof HTMLElement)
      text2.appendChild(s4.label);
    else
      text2.textContent = s4.label;
    if (i4 > 0) {
      if (!markers.show)
        text2.style.color = s4.width > 0 ? markers.stroke(self, i4) : markers.fill(self, i4);
      onMouse("click", label, (e4) => {
        if (cursor._lock)
          return;
        setCursorEvent(e4);
        let seriesIdx = series.indexOf(s4);
        if ((e4.ctrlKey || e4.metaKey) != legend.isolate) {
          let isolate = series.some((s5, i5) => i5 > 0 && i5 != seriesIdx && s5.show);
          series.forEach((s5, i5) => {
            i5 > 0 && setSeries(i5, isolate ? i5 == seriesIdx ? son : soff : son, true, syncOpts.setSeries);
          });
        } else
          setSeries(seriesIdx, { show: !s4.show }, true, syncOpts.setSeries);
      }, false);
      if (cursorFocus) {
        onMouse(mouseenter, label, (e4) => {
          if (cursor._lock)
            return;
          setCursorEvent(e4);
          setSeries(series.indexOf(s4), FOCUS_TRUE, true, syncOpts.setSeries);
        }, false);
      }
    }
    for (var key2 in legendCols) {
      let v4 = placeTag("td", LEGEND_VALUE, row);
      v4.textContent = "--";
      cells.push(v4);
    }
    return [row, cells];
  }
  const mouseListeners = /* @__PURE__ */ new Map();
  function onMouse(ev, targ, fn, onlyTarg = true) {
    const targListeners = mouseListeners.get(targ) || {};
    const listener = cursor.bind[ev](self, targ, fn, onlyTarg);
    if (listener) {
      on(ev, targ, targListeners[ev] = listener);
      mouseListeners.set(targ, targListeners);
    }
  }
  function offMouse(ev, targ, fn) {
    const targListeners = mouseListeners.get(targ) || {};
    for (let k4 in targListeners) {
      if (ev == null || k4 == ev) {
        off(k4, targ, targListeners[k4]);
        delete targListeners[k4];
      }
    }
    if (ev == null)
      mouseListeners.delete(targ);
  }
  let fullWidCss = 0;
  let fullHgtCss = 0;
  let plotWidCss = 0;
  let plotHgtCss = 0;
  let plotLftCss = 0;
  let plotTopCss = 0;
  let _plotLftCss = plotLftCss;
  let _plotTopCss = plotTopCss;
  let _plotWidCss = plotWidCss;
  let _plotHgtCss = plotHgtCss;
  let plotLft = 0;
  let plotTop = 0;
  let plotWid = 0;
  let plotHgt = 0;
  self.bbox = {};
  let shouldSetScales = false;
  let shouldSetSize = false;
  let shouldConvergeSize = false;
  let shouldSetCursor = false;
  let shouldSetSelect = false;
  let shouldSetLegend = false;
  function _setSize(width, height, force) {
    if (force || (width != self.width || height != self.height))
      calcSize(width, height);
    resetYSeries(false);
    shouldConvergeSize = true;
    shouldSetSize = true;
    commit();
  }
  function calcSize(width, height) {
    self.width = fullWidCss = plotWidCss = width;
    self.height = fullHgtCss = plotHgtCss = height;
    plotLftCss = plotTopCss = 0;
    calcPlotRect();
    calcAxesRects();
    let bb = self.bbox;
    plotLft = bb.left = incrRound(plotLftCss * pxRatio, 0.5);
    plotTop = bb.top = incrRound(plotTopCss * pxRatio, 0.5);
    plotWid = bb.width = incrRound(plotWidCss * pxRatio, 0.5);
    plotHgt = bb.height = incrRound(plotHgtCss * pxRatio, 0.5);
  }
  const CYCLE_LIMIT = 3;
  function convergeSize() {
    let converged = false;
    let cycleNum = 0;
    while (!converged) {
      cycleNum++;
      let axesConverged = axesCalc(cycleNum);
      let paddingConverged = paddingCalc(cycleNum);
      converged = cycleNum == CYCLE_LIMIT || axesConverged && paddingConverged;
      if (!converged) {
        calcSize(self.width, self.height);
        shouldSetSize = true;
      }
    }
  }
  function setSize({ width, height }) {
    _setSize(width, height);
  }
  self.setSize = setSize;
  function calcPlotRect() {
    let hasTopAxis = false;
    let hasBtmAxis = false;
    let hasRgtAxis = false;
    let hasLftAxis = false;
    axes.forEach((axis, i4) => {
      if (axis.show && axis._show) {
        let { side, _size } = axis;
        let isVt = side % 2;
        let labelSize = axis.label != null ? axis.labelSize : 0;
        let fullSize = _size + labelSize;
        if (fullSize > 0) {
          if (isVt) {
            plotWidCss -= fullSize;
            if (side == 3) {
              plotLftCss += fullSize;
              hasLftAxis = true;
            } else
              hasRgtAxis = true;
          } else {
            plotHgtCss -= fullSize;
            if (side == 0) {
              plotTopCss += fullSize;
              hasTopAxis = true;
            } else
              hasBtmAxis = true;
          }
        }
      }
    });
    sidesWithAxes[0] = hasTopAxis;
    sidesWithAxes[1] = hasRgtAxis;
    sidesWithAxes[2] = hasBtmAxis;
    sidesWithAxes[3] = hasLftAxis;
    plotWidCss -= _padding[1] + _padding[3];
    plotLftCss += _padding[3];
    plotHgtCss -= _padding[2] + _padding[0];
    plotTopCss += _padding[0];
  }
  function calcAxesRects() {
    let off1 = plotLftCss + plotWidCss;
    let off2 = plotTopCss + plotHgtCss;
    let off3 = plotLftCss;
    let off0 = plotTopCss;
    function incrOffset(side, size) {
      switch (side) {
        case 1:
          off1 += size;
          return off1 - size;
        case 2:
          off2 += size;
          return off2 - size;
        case 3:
          off3 -= size;
          return off3 + size;
        case 0:
          off0 -= size;
          return off0 + size;
      }
    }
    axes.forEach((axis, i4) => {
      if (axis.show && axis._show) {
        let side = axis.side;
        axis._pos = incrOffset(side, axis._size);
        if (axis.label != null)
          axis._lpos = incrOffset(side, axis.labelSize);
      }
    });
  }
  if (cursor.dataIdx == null) {
    let hov = cursor.hover;
    let skip = hov.skip = new Set(hov.skip ?? []);
    skip.add(void 0);
    let prox = hov.prox = fnOrSelf(hov.prox);
    let bias = hov.bias ??= 0;
    cursor.dataIdx = (self2, seriesIdx, cursorIdx, valAtPosX) => {
      if (seriesIdx == 0)
        return cursorIdx;
      let idx2 = cursorIdx;
      let _prox = prox(self2, seriesIdx, cursorIdx, valAtPosX) ?? inf;
      let withProx = _prox >= 0 && _prox < inf;
      let xDim = scaleX.ori == 0 ? plotWidCss : plotHgtCss;
      let cursorLft = cursor.left;
      let xValues = data[0];
      let yValues = data[seriesIdx];
      if (skip.has(yValues[cursorIdx])) {
        idx2 = null;
        let nonNullLft = null, nonNullRgt = null, j3;
        if (bias == 0 || bias == -1) {
          j3 = cursorIdx;
          while (nonNullLft == null && j3-- > 0) {
            if (!skip.has(yValues[j3]))
              nonNullLft = j3;
          }
        }
        if (bias == 0 || bias == 1) {
          j3 = cursorIdx;
          while (nonNullRgt == null && j3++ < yValues.length) {
            if (!skip.has(yValues[j3]))
              nonNullRgt = j3;
          }
        }
        if (nonNullLft != null || nonNullRgt != null) {
          if (withProx) {
            let lftPos = nonNullLft == null ? -Infinity : valToPosX(xValues[nonNullLft], scaleX, xDim, 0);
            let rgtPos = nonNullRgt == null ? Infinity : valToPosX(xValues[nonNullRgt], scaleX, xDim, 0);
            let lftDelta = cursorLft - lftPos;
            let rgtDelta = rgtPos - cursorLft;
            if (lftDelta <= rgtDelta) {
              if (lftDelta <= _prox)
                idx2 = nonNullLft;
            } else {
              if (rgtDelta <= _prox)
                idx2 = nonNullRgt;
            }
          } else {
            idx2 = nonNullRgt == null ? nonNullLft : nonNullLft == null ? nonNullRgt : cursorIdx - nonNullLft <= nonNullRgt - cursorIdx ? nonNullLft : nonNullRgt;
          }
        }
      } else if (withProx) {
        let dist = abs(cursorLft - valToPosX(xValues[cursorIdx], scaleX, xDim, 0));
        if (dist > _prox)
          idx2 = null;
      }
      return idx2;
    };
  }
  const setCursorEvent = (e4) => {
    cursor.event = e4;
  };
  cursor.idxs = activeIdxs;
  cursor._lock = false;
  let points2 = cursor.points;
  points2.show = fnOrSelf(points2.show);
  points2.size = fnOrSelf(points2.size);
  points2.stroke = fnOrSelf(points2.stroke);
  points2.width = fnOrSelf(points2.width);
  points2.fill = fnOrSelf(points2.fill);
  const focus = self.focus = assign({}, opts.focus || { alpha: 0.3 }, cursor.focus);
  const cursorFocus = focus.prox >= 0;
  const cursorOnePt = cursorFocus && points2.one;
  let cursorPts = [];
  let cursorPtsLft = [];
  let cursorPtsTop = [];
  function initCursorPt(s4, si) {
    let pt = points2.show(self, si);
    if (pt instanceof HTMLElement) {
      addClass(pt, CURSOR_PT);
      addClass(pt, s4.class);
      elTrans(pt, -10, -10, plotWidCss, plotHgtCss);
      over.insertBefore(pt, cursorPts[si]);
      return pt;
    }
  }
  function initSeries(s4, i4) {
    if (mode == 1 || i4 > 0) {
      let isTime = mode == 1 && scales[s4.scale].time;
      let sv = s4.value;
      s4.value = isTime ? isStr(sv) ? timeSeriesVal(_tzDate, timeSeriesStamp(sv, _fmtDate)) : sv || _timeSeriesVal : sv || numSeriesVal;
      s4.label = s4.label || (isTime ? timeSeriesLabel : numSeriesLabel);
    }
    if (cursorOnePt || i4 > 0) {
      s4.width = s4.width == null ? 1 : s4.width;
      s4.paths = s4.paths || linearPath || retNull;
      s4.fillTo = fnOrSelf(s4.fillTo || seriesFillTo);
      s4.pxAlign = +ifNull(s4.pxAlign, pxAlign);
      s4.pxRound = pxRoundGen(s4.pxAlign);
      s4.stroke = fnOrSelf(s4.stroke || null);
      s4.fill = fnOrSelf(s4.fill || null);
      s4._stroke = s4._fill = s4._paths = s4._focus = null;
      let _ptDia = ptDia(max(1, s4.width), 1);
      let points3 = s4.points = assign({}, {
        size: _ptDia,
        width: max(1, _ptDia * 0.2),
        stroke: s4.stroke,
        space: _ptDia * 2,
        paths: pointsPath,
        _stroke: null,
        _fill: null
      }, s4.points);
      points3.show = fnOrSelf(points3.show);
      points3.filter = fnOrSelf(points3.filter);
      points3.fill = fnOrSelf(points3.fill);
      points3.stroke = fnOrSelf(points3.stroke);
      points3.paths = fnOrSelf(points3.paths);
      points3.pxAlign = s4.pxAlign;
    }
    if (showLegend) {
      let rowCells = initLegendRow(s4, i4);
      legendRows.splice(i4, 0, rowCells[0]);
      legendCells.splice(i4, 0, rowCells[1]);
      legend.values.push(null);
    }
    if (showCursor) {
      activeIdxs.splice(i4, 0, null);
      let pt = null;
      if (cursorOnePt) {
        if (i4 == 0)
          pt = initCursorPt(s4, i4);
      } else if (i4 > 0)
        pt = initCursorPt(s4, i4);
      cursorPts.splice(i4, 0, pt);
      cursorPtsLft.splice(i4, 0, 0);
      cursorPtsTop.splice(i4, 0, 0);
    }
    fire("addSeries", i4);
  }
  function addSeries(opts2, si) {
    si = si == null ? series.length : si;
    opts2 = mode == 1 ? setDefault(opts2, si, xSeriesOpts, ySeriesOpts) : setDefault(opts2, si, {}, xySeriesOpts);
    series.splice(si, 0, opts2);
    initSeries(series[si], si);
  }
  self.addSeries = addSeries;
  function delSeries(i4) {
    series.splice(i4, 1);
    if (showLegend) {
      legend.values.splice(i4, 1);
      legendCells.splice(i4, 1);
      let tr = legendRows.splice(i4, 1)[0];
      offMouse(null, tr.firstChild);
      tr.remove();
    }
    if (showCursor) {
      activeIdxs.splice(i4, 1);
      cursorPts.splice(i4, 1)[0].remove();
      cursorPtsLft.splice(i4, 1);
      cursorPtsTop.splice(i4, 1);
    }
    fire("delSeries", i4);
  }
  self.delSeries = delSeries;
  const sidesWithAxes = [false, false, false, false];
  function initAxis(axis, i4) {
    axis._show = axis.show;
    if (axis.show) {
      let isVt = axis.side % 2;
      let sc = scales[axis.scale];
      if (sc == null) {
        axis.scale = isVt ? series[1].scale : xScaleKey;
        sc = scales[axis.scale];
      }
      let isTime = sc.time;
      axis.size = fnOrSelf(axis.size);
      axis.space = fnOrSelf(axis.space);
      axis.rotate = fnOrSelf(axis.rotate);
      if (isArr(axis.incrs)) {
        axis.incrs.forEach((incr) => {
          !fixedDec.has(incr) && fixedDec.set(incr, guessDec(incr));
        });
      }
      axis.incrs = fnOrSelf(axis.incrs || (sc.distr == 2 ? wholeIncrs : isTime ? ms2 == 1 ? timeIncrsMs : timeIncrsS : numIncrs));
      axis.splits = fnOrSelf(axis.splits || (isTime && sc.distr == 1 ? _timeAxisSplits : sc.distr == 3 ? logAxisSplits : sc.distr == 4 ? asinhAxisSplits : numAxisSplits));
      axis.stroke = fnOrSelf(axis.stroke);
      axis.grid.stroke = fnOrSelf(axis.grid.stroke);
      axis.ticks.stroke = fnOrSelf(axis.ticks.stroke);
      axis.border.stroke = fnOrSelf(axis.border.stroke);
      let av = axis.values;
      axis.values = // static array of tick values
      isArr(av) && !isArr(av[0]) ? fnOrSelf(av) : (
        // temporal
        isTime ? (
          // config array of fmtDate string tpls
          isArr(av) ? timeAxisVals(_tzDate, timeAxisStamps(av, _fmtDate)) : (
            // fmtDate string tpl
            isStr(av) ? timeAxisVal(_tzDate, av) : av || _timeAxisVals
          )
        ) : av || numAxisVals
      );
      axis.filter = fnOrSelf(axis.filter || (sc.distr >= 3 && sc.log == 10 ? log10AxisValsFilt : sc.distr == 3 && sc.log == 2 ? log2AxisValsFilt : retArg1));
      axis.font = pxRatioFont(axis.font);
      axis.labelFont = pxRatioFont(axis.labelFont);
      axis._size = axis.size(self, null, i4, 0);
      axis._space = axis._rotate = axis._incrs = axis._found = // foundIncrSpace
      axis._splits = axis._values = null;
      if (axis._size > 0) {
        sidesWithAxes[i4] = true;
        axis._el = placeDiv(AXIS, wrap);
      }
    }
  }
  function autoPadSide(self2, side, sidesWithAxes2, cycleNum) {
    let [hasTopAxis, hasRgtAxis, hasBtmAxis, hasLftAxis] = sidesWithAxes2;
    let ori = side % 2;
    let size = 0;
    if (ori == 0 && (hasLftAxis || hasRgtAxis))
      size = side == 0 && !hasTopAxis || side == 2 && !hasBtmAxis ? round(xAxisOpts.size / 3) : 0;
    if (ori == 1 && (hasTopAxis || hasBtmAxis))
      size = side == 1 && !hasRgtAxis || side == 3 && !hasLftAxis ? round(yAxisOpts.size / 2) : 0;
    return size;
  }
  const padding = self.padding = (opts.padding || [autoPadSide, autoPadSide, autoPadSide, autoPadSide]).map((p5) => fnOrSelf(ifNull(p5, autoPadSide)));
  const _padding = self._padding = padding.map((p5, i4) => p5(self, i4, sidesWithAxes, 0));
  let dataLen;
  let i0 = null;
  let i1 = null;
  const idxs = mode == 1 ? series[0].idxs : null;
  let data0 = null;
  let viaAutoScaleX = false;
  function setData(_data, _resetScales) {
    data = _data == null ? [] : _data;
    self.data = self._data = data;
    if (mode == 2) {
      dataLen = 0;
      for (let i4 = 1; i4 < series.length; i4++)
        dataLen += data[i4][0].length;
    } else {
      if (data.length == 0)
        self.data = self._data = data = [[]];
      data0 = data[0];
      dataLen = data0.length;
      let scaleData = data;
      if (xScaleDistr == 2) {
        scaleData = data.slice();
        let _data0 = scaleData[0] = Array(dataLen);
        for (let i4 = 0; i4 < dataLen; i4++)
          _data0[i4] = i4;
      }
      self._data = data = scaleData;
    }
    resetYSeries(true);
    fire("setData");
    if (xScaleDistr == 2) {
      shouldConvergeSize = true;
    }
    if (_resetScales !== false) {
      let xsc = scaleX;
      if (xsc.auto(self, viaAutoScaleX))
        autoScaleX();
      else
        _setScale(xScaleKey, xsc.min, xsc.max);
      shouldSetCursor = shouldSetCursor || cursor.left >= 0;
      shouldSetLegend = true;
      commit();
    }
  }
  self.setData = setData;
  function autoScaleX() {
    viaAutoScaleX = true;
    let _min, _max;
    if (mode == 1) {
      if (dataLen > 0) {
        i0 = idxs[0] = 0;
        i1 = idxs[1] = dataLen - 1;
        _min = data[0][i0];
        _max = data[0][i1];
        if (xScaleDistr == 2) {
          _min = i0;
          _max = i1;
        } else if (_min == _max) {
          if (xScaleDistr == 3)
            [_min, _max] = rangeLog(_min, _min, scaleX.log, false);
          else if (xScaleDistr == 4)
            [_min, _max] = rangeAsinh(_min, _min, scaleX.log, false);
          else if (scaleX.time)
            _max = _min + round(86400 / ms2);
          else
            [_min, _max] = rangeNum(_min, _max, rangePad, true);
        }
      } else {
        i0 = idxs[0] = _min = null;
        i1 = idxs[1] = _max = null;
      }
    }
    _setScale(xScaleKey, _min, _max);
  }
  let ctxStroke, ctxFill, ctxWidth, ctxDash, ctxJoin, ctxCap, ctxFont, ctxAlign, ctxBaseline;
  let ctxAlpha;
  function setCtxStyle(stroke, width, dash, cap, fill, join2) {
    stroke ??= transparent;
    dash ??= EMPTY_ARR;
    cap ??= "butt";
    fill ??= transparent;
    join2 ??= "round";
    if (stroke != ctxStroke)
      ctx.strokeStyle = ctxStroke = stroke;
    if (fill != ctxFill)
      ctx.fillStyle = ctxFill = fill;
    if (width != ctxWidth)
      ctx.lineWidth = ctxWidth = width;
    if (join2 != ctxJoin)
      ctx.lineJoin = ctxJoin = join2;
    if (cap != ctxCap)
      ctx.lineCap = ctxCap = cap;
    if (dash != ctxDash)
      ctx.setLineDash(ctxDash = dash);
  }
  function setFontStyle(font2, fill, align, baseline) {
    if (fill != ctxFill)
      ctx.fillStyle = ctxFill = fill;
    if (font2 != ctxFont)
      ctx.font = ctxFont = font2;
    if (align != ctxAlign)
      ctx.textAlign = ctxAlign = align;
    if (baseline != ctxBaseline)
      ctx.textBaseline = ctxBaseline = baseline;
  }
  function accScale(wsc, psc, facet2, data2, sorted2 = 0) {
    if (data2.length > 0 && wsc.auto(self, viaAutoScaleX) && (psc == null || psc.min == null)) {
      let _i0 = ifNull(i0, 0);
      let _i1 = ifNull(i1, data2.length - 1);
      let minMax = facet2.min == null ? getMinMax(data2, _i0, _i1, sorted2, wsc.distr == 3) : [facet2.min, facet2.max];
      wsc.min = min(wsc.min, facet2.min = minMax[0]);
      wsc.max = max(wsc.max, facet2.max = minMax[1]);
    }
  }
  const AUTOSCALE = { min: null, max: null };
  function setScales() {
    for (let k4 in scales) {
      let sc = scales[k4];
      if (pendScales[k4] == null && // scales that have never been set (on init)
      (sc.min == null || // or auto scales when the x scale was explicitly set
      pendScales[xScaleKey] != null && sc.auto(self, viaAutoScaleX))) {
        pendScales[k4] = AUTOSCALE;
      }
    }
    for (let k4 in scales) {
      let sc = scales[k4];
      if (pendScales[k4] == null && sc.from != null && pendScales[sc.from] != null)
        pendScales[k4] = AUTOSCALE;
    }
    if (pendScales[xScaleKey] != null)
      resetYSeries(true);
    let wipScales = {};
    for (let k4 in pendScales) {
      let psc = pendScales[k4];
      if (psc != null) {
        let wsc = wipScales[k4] = copy(scales[k4], fastIsObj);
        if (psc.min != null)
          assign(wsc, psc);
        else if (k4 != xScaleKey || mode == 2) {
          if (dataLen == 0 && wsc.from == null) {
            let minMax = wsc.range(self, null, null, k4);
            wsc.min = minMax[0];
            wsc.max = minMax[1];
          } else {
            wsc.min = inf;
            wsc.max = -inf;
          }
        }
      }
    }
    if (dataLen > 0) {
      series.forEach((s4, i4) => {
        if (mode == 1) {
          let k4 = s4.scale;
          let psc = pendScales[k4];
          if (psc == null)
            return;
          let wsc = wipScales[k4];
          if (i4 == 0) {
            let minMax = wsc.range(self, wsc.min, wsc.max, k4);
            wsc.min = minMax[0];
            wsc.max = minMax[1];
            i0 = closestIdx(wsc.min, data[0]);
            i1 = closestIdx(wsc.max, data[0]);
            if (i1 - i0 > 1) {
              if (data[0][i0] < wsc.min)
                i0++;
              if (data[0][i1] > wsc.max)
                i1--;
            }
            s4.min = data0[i0];
            s4.max = data0[i1];
          } else if (s4.show && s4.auto)
            accScale(wsc, psc, s4, data[i4], s4.sorted);
          s4.idxs[0] = i0;
          s4.idxs[1] = i1;
        } else {
          if (i4 > 0) {
            if (s4.show && s4.auto) {
              let [xFacet, yFacet] = s4.facets;
              let xScaleKey2 = xFacet.scale;
              let yScaleKey = yFacet.scale;
              let [xData, yData] = data[i4];
              let wscx = wipScales[xScaleKey2];
              let wscy = wipScales[yScaleKey];
              wscx != null && accScale(wscx, pendScales[xScaleKey2], xFacet, xData, xFacet.sorted);
              wscy != null && accScale(wscy, pendScales[yScaleKey], yFacet, yData, yFacet.sorted);
              s4.min = yFacet.min;
              s4.max = yFacet.max;
            }
          }
        }
      });
      for (let k4 in wipScales) {
        let wsc = wipScales[k4];
        let psc = pendScales[k4];
        if (wsc.from == null && (psc == null || psc.min == null)) {
          let minMax = wsc.range(
            self,
            wsc.min == inf ? null : wsc.min,
            wsc.max == -inf ? null : wsc.max,
            k4
          );
          wsc.min = minMax[0];
          wsc.max = minMax[1];
        }
      }
    }
    for (let k4 in wipScales) {
      let wsc = wipScales[k4];
      if (wsc.from != null) {
        let base = wipScales[wsc.from];
        if (base.min == null)
          wsc.min = wsc.max = null;
        else {
          let minMax = wsc.range(self, base.min, base.max, k4);
          wsc.min = minMax[0];
          wsc.max = minMax[1];
        }
      }
    }
    let changed = {};
    let anyChanged = false;
    for (let k4 in wipScales) {
      let wsc = wipScales[k4];
      let sc = scales[k4];
      if (sc.min != wsc.min || sc.max != wsc.max) {
        sc.min = wsc.min;
        sc.max = wsc.max;
        let distr = sc.distr;
        sc._min = distr == 3 ? log10(sc.min) : distr == 4 ? asinh(sc.min, sc.asinh) : distr == 100 ? sc.fwd(sc.min) : sc.min;
        sc._max = distr == 3 ? log10(sc.max) : distr == 4 ? asinh(sc.max, sc.asinh) : distr == 100 ? sc.fwd(sc.max) : sc.max;
        changed[k4] = anyChanged = true;
      }
    }
    if (anyChanged) {
      series.forEach((s4, i4) => {
        if (mode == 2) {
          if (i4 > 0 && changed.y)
            s4._paths = null;
        } else {
          if (changed[s4.scale])
            s4._paths = null;
        }
      });
      for (let k4 in changed) {
        shouldConvergeSize = true;
        fire("setScale", k4);
      }
      if (showCursor && cursor.left >= 0)
        shouldSetCursor = shouldSetLegend = true;
    }
    for (let k4 in pendScales)
      pendScales[k4] = null;
  }
  function getOuterIdxs(ydata) {
    let _i0 = clamp(i0 - 1, 0, dataLen - 1);
    let _i1 = clamp(i1 + 1, 0, dataLen - 1);
    while (ydata[_i0] == null && _i0 > 0)
      _i0--;
    while (ydata[_i1] == null && _i1 < dataLen - 1)
      _i1++;
    return [_i0, _i1];
  }
  function drawSeries() {
    if (dataLen > 0) {
      let shouldAlpha = series.some((s4) => s4._focus) && ctxAlpha != focus.alpha;
      if (shouldAlpha)
        ctx.globalAlpha = ctxAlpha = focus.alpha;
      series.forEach((s4, i4) => {
        if (i4 > 0 && s4.show) {
          cacheStrokeFill(i4, false);
          cacheStrokeFill(i4, true);
          if (s4._paths == null) {
            let _ctxAlpha = ctxAlpha;
            if (ctxAlpha != s4.alpha)
              ctx.globalAlpha = ctxAlpha = s4.alpha;
            let _idxs = mode == 2 ? [0, data[i4][0].length - 1] : getOuterIdxs(data[i4]);
            s4._paths = s4.paths(self, i4, _idxs[0], _idxs[1]);
            if (ctxAlpha != _ctxAlpha)
              ctx.globalAlpha = ctxAlpha = _ctxAlpha;
          }
        }
      });
      series.forEach((s4, i4) => {
        if (i4 > 0 && s4.show) {
          let _ctxAlpha = ctxAlpha;
          if (ctxAlpha != s4.alpha)
            ctx.globalAlpha = ctxAlpha = s4.alpha;
          s4._paths != null && drawPath(i4, false);
          {
            let _gaps = s4._paths != null ? s4._paths.gaps : null;
            let show2 = s4.points.show(self, i4, i0, i1, _gaps);
            let idxs2 = s4.points.filter(self, i4, show2, _gaps);
            if (show2 || idxs2) {
              s4.points._paths = s4.points.paths(self, i4, i0, i1, idxs2);
              drawPath(i4, true);
            }
          }
          if (ctxAlpha != _ctxAlpha)
            ctx.globalAlpha = ctxAlpha = _ctxAlpha;
          fire("drawSeries", i4);
        }
      });
      if (shouldAlpha)
        ctx.globalAlpha = ctxAlpha = 1;
    }
  }
  function cacheStrokeFill(si, _points) {
    let s4 = _points ? series[si].points : series[si];
    s4._stroke = s4.stroke(self, si);
    s4._fill = s4.fill(self, si);
  }
  function drawPath(si, _points) {
    let s4 = _points ? series[si].points : series[si];
    let {
      stroke,
      fill,
      clip: gapsClip,
      flags,
      _stroke: strokeStyle = s4._stroke,
      _fill: fillStyle = s4._fill,
      _width: width = s4.width
    } = s4._paths;
    width = roundDec(width * pxRatio, 3);
    let boundsClip = null;
    let offset = width % 2 / 2;
    if (_points && fillStyle == null)
      fillStyle = width > 0 ? "#fff" : strokeStyle;
    let _pxAlign = s4.pxAlign == 1 && offset > 0;
    _pxAlign && ctx.translate(offset, offset);
    if (!_points) {
      let lft = plotLft - width / 2, top = plotTop - width / 2, wid = plotWid + width, hgt = plotHgt + width;
      boundsClip = new Path2D();
      boundsClip.rect(lft, top, wid, hgt);
    }
    if (_points)
      strokeFill(strokeStyle, width, s4.dash, s4.cap, fillStyle, stroke, fill, flags, gapsClip);
    else
      fillStroke(si, strokeStyle, width, s4.dash, s4.cap, fillStyle, stroke, fill, flags, boundsClip, gapsClip);
    _pxAlign && ctx.translate(-offset, -offset);
  }
  function fillStroke(si, strokeStyle, lineWidth, lineDash, lineCap, fillStyle, strokePath, fillPath, flags, boundsClip, gapsClip) {
    let didStrokeFill = false;
    flags != 0 && bands.forEach((b3, bi) => {
      if (b3.series[0] == si) {
        let lowerEdge = series[b3.series[1]];
        let lowerData = data[b3.series[1]];
        let bandClip = (lowerEdge._paths || EMPTY_OBJ).band;
        if (isArr(bandClip))
          bandClip = b3.dir == 1 ? bandClip[0] : bandClip[1];
        let gapsClip2;
        let _fillStyle = null;
        if (lowerEdge.show && bandClip && hasData(lowerData, i0, i1)) {
          _fillStyle = b3.fill(self, bi) || fillStyle;
          gapsClip2 = lowerEdge._paths.clip;
        } else
          bandClip = null;
        strokeFill(strokeStyle, lineWidth, lineDash, lineCap, _fillStyle, strokePath, fillPath, flags, boundsClip, gapsClip, gapsClip2, bandClip);
        didStrokeFill = true;
      }
    });
    if (!didStrokeFill)
      strokeFill(strokeStyle, lineWidth, lineDash, lineCap, fillStyle, strokePath, fillPath, flags, boundsClip, gapsClip);
  }
  const CLIP_FILL_STROKE = BAND_CLIP_FILL | BAND_CLIP_STROKE;
  function strokeFill(strokeStyle, lineWidth, lineDash, lineCap, fillStyle, strokePath, fillPath, flags, boundsClip, gapsClip, gapsClip2, bandClip) {
    setCtxStyle(strokeStyle, lineWidth, lineDash, lineCap, fillStyle);
    if (boundsClip || gapsClip || bandClip) {
      ctx.save();
      boundsClip && ctx.clip(boundsClip);
      gapsClip && ctx.clip(gapsClip);
    }
    if (bandClip) {
      if ((flags & CLIP_FILL_STROKE) == CLIP_FILL_STROKE) {
        ctx.clip(bandClip);
        gapsClip2 && ctx.clip(gapsClip2);
        doFill(fillStyle, fillPath);
        doStroke(strokeStyle, strokePath, lineWidth);
      } else if (flags & BAND_CLIP_STROKE) {
        doFill(fillStyle, fillPath);
        ctx.clip(bandClip);
        doStroke(strokeStyle, strokePath, lineWidth);
      } else if (flags & BAND_CLIP_FILL) {
        ctx.save();
        ctx.clip(bandClip);
        gapsClip2 && ctx.clip(gapsClip2);
        doFill(fillStyle, fillPath);
        ctx.restore();
        doStroke(strokeStyle, strokePath, lineWidth);
      }
    } else {
      doFill(fillStyle, fillPath);
      doStroke(strokeStyle, strokePath, lineWidth);
    }
    if (boundsClip || gapsClip || bandClip)
      ctx.restore();
  }
  function doStroke(strokeStyle, strokePath, lineWidth) {
    if (lineWidth > 0) {
      if (strokePath instanceof Map) {
        strokePath.forEach((strokePath2, strokeStyle2) => {
          ctx.strokeStyle = ctxStroke = strokeStyle2;
          ctx.stroke(strokePath2);
        });
      } else
        strokePath != null && strokeStyle && ctx.stroke(strokePath);
    }
  }
  function doFill(fillStyle, fillPath) {
    if (fillPath instanceof Map) {
      fillPath.forEach((fillPath2, fillStyle2) => {
        ctx.fillStyle = ctxFill = fillStyle2;
        ctx.fill(fillPath2);
      });
    } else
      fillPath != null && fillStyle && ctx.fill(fillPath);
  }
  function getIncrSpace(axisIdx, min2, max2, fullDim) {
    let axis = axes[axisIdx];
    let incrSpace;
    if (fullDim <= 0)
      incrSpace = [0, 0];
    else {
      let minSpace = axis._space = axis.space(self, axisIdx, min2, max2, fullDim);
      let incrs = axis._incrs = axis.incrs(self, axisIdx, min2, max2, fullDim, minSpace);
      incrSpace = findIncr(min2, max2, incrs, fullDim, minSpace);
    }
    return axis._found = incrSpace;
  }
  function drawOrthoLines(offs, filts, ori, side, pos0, len, width, stroke, dash, cap) {
    let offset = width % 2 / 2;
    pxAlign == 1 && ctx.translate(offset, offset);
    setCtxStyle(stroke, width, dash, cap, stroke);
    ctx.beginPath();
    let x0, y0, x1, y1, pos1 = pos0 + (side == 0 || side == 3 ? -len : len);
    if (ori == 0) {
      y0 = pos0;
      y1 = pos1;
    } else {
      x0 = pos0;
      x1 = pos1;
    }
    for (let i4 = 0; i4 < offs.length; i4++) {
      if (filts[i4] != null) {
        if (ori == 0)
          x0 = x1 = offs[i4];
        else
          y0 = y1 = offs[i4];
        ctx.moveTo(x0, y0);
        ctx.lineTo(x1, y1);
      }
    }
    ctx.stroke();
    pxAlign == 1 && ctx.translate(-offset, -offset);
  }
  function axesCalc(cycleNum) {
    let converged = true;
    axes.forEach((axis, i4) => {
      if (!axis.show)
        return;
      let scale = scales[axis.scale];
      if (scale.min == null) {
        if (axis._show) {
          converged = false;
          axis._show = false;
          resetYSeries(false);
        }
        return;
      } else {
        if (!axis._show) {
          converged = false;
          axis._show = true;
          resetYSeries(false);
        }
      }
      let side = axis.side;
      let ori = side % 2;
      let { min: min2, max: max2 } = scale;
      let [_incr, _space] = getIncrSpace(i4, min2, max2, ori == 0 ? plotWidCss : plotHgtCss);
      if (_space == 0)
        return;
      let forceMin = scale.distr == 2;
      let _splits = axis._splits = axis.splits(self, i4, min2, max2, _incr, _space, forceMin);
      let splits = scale.distr == 2 ? _splits.map((i5) => data0[i5]) : _splits;
      let incr = scale.distr == 2 ? data0[_splits[1]] - data0[_splits[0]] : _incr;
      let values = axis._values = axis.values(self, axis.filter(self, splits, i4, _space, incr), i4, _space, incr);
      axis._rotate = side == 2 ? axis.rotate(self, values, i4, _space) : 0;
      let oldSize = axis._size;
      axis._size = ceil(axis.size(self, values, i4, cycleNum));
      if (oldSize != null && axis._size != oldSize)
        converged = false;
    });
    return converged;
  }
  function paddingCalc(cycleNum) {
    let converged = true;
    padding.forEach((p5, i4) => {
      let _p = p5(self, i4, sidesWithAxes, cycleNum);
      if (_p != _padding[i4])
        converged = false;
      _padding[i4] = _p;
    });
    return converged;
  }
  function drawAxesGrid() {
    for (let i4 = 0; i4 < axes.length; i4++) {
      let axis = axes[i4];
      if (!axis.show || !axis._show)
        continue;
      let side = axis.side;
      let ori = side % 2;
      let x3, y5;
      let fillStyle = axis.stroke(self, i4);
      let shiftDir = side == 0 || side == 3 ? -1 : 1;
      let [_incr, _space] = axis._found;
      if (axis.label != null) {
        let shiftAmt2 = axis.labelGap * shiftDir;
        let baseLpos = round((axis._lpos + shiftAmt2) * pxRatio);
        setFontStyle(axis.labelFont[0], fillStyle, "center", side == 2 ? TOP2 : BOTTOM);
        ctx.save();
        if (ori == 1) {
          x3 = y5 = 0;
          ctx.translate(
            baseLpos,
            round(plotTop + plotHgt / 2)
          );
          ctx.rotate((side == 3 ? -PI : PI) / 2);
        } else {
          x3 = round(plotLft + plotWid / 2);
          y5 = baseLpos;
        }
        let _label = isFn(axis.label) ? axis.label(self, i4, _incr, _space) : axis.label;
        ctx.fillText(_label, x3, y5);
        ctx.restore();
      }
      if (_space == 0)
        continue;
      let scale = scales[axis.scale];
      let plotDim = ori == 0 ? plotWid : plotHgt;
      let plotOff = ori == 0 ? plotLft : plotTop;
      let _splits = axis._splits;
      let splits = scale.distr == 2 ? _splits.map((i5) => data0[i5]) : _splits;
      let incr = scale.distr == 2 ? data0[_splits[1]] - data0[_splits[0]] : _incr;
      let ticks2 = axis.ticks;
      let border2 = axis.border;
      let _tickSize = ticks2.show ? ticks2.size : 0;
      let tickSize = round(_tickSize * pxRatio);
      let axisGap = round((axis.alignTo == 2 ? axis._size - _tickSize - axis.gap : axis.gap) * pxRatio);
      let angle = axis._rotate * -PI / 180;
      let basePos = pxRound(axis._pos * pxRatio);
      let shiftAmt = (tickSize + axisGap) * shiftDir;
      let finalPos = basePos + shiftAmt;
      y5 = ori == 0 ? finalPos : 0;
      x3 = ori == 1 ? finalPos : 0;
      let font2 = axis.font[0];
      let textAlign = axis.align == 1 ? LEFT : axis.align == 2 ? RIGHT3 : angle > 0 ? LEFT : angle < 0 ? RIGHT3 : ori == 0 ? "center" : side == 3 ? RIGHT3 : LEFT;
      let textBaseline = angle || ori == 1 ? "middle" : side == 2 ? TOP2 : BOTTOM;
      setFontStyle(font2, fillStyle, textAlign, textBaseline);
      let lineHeight = axis.font[1] * axis.lineGap;
      let canOffs = _splits.map((val) => pxRound(getPos(val, scale, plotDim, plotOff)));
      let _values = axis._values;
      for (let i5 = 0; i5 < _values.length; i5++) {
        let val = _values[i5];
        if (val != null) {
          if (ori == 0)
            x3 = canOffs[i5];
          else
            y5 = canOffs[i5];
          val = "" + val;
          let _parts = val.indexOf("\n") == -1 ? [val] : val.split(/\n/gm);
          for (let j3 = 0; j3 < _parts.length; j3++) {
            let text2 = _parts[j3];
            if (angle) {
              ctx.save();
              ctx.translate(x3, y5 + j3 * lineHeight);
              ctx.rotate(angle);
              ctx.fillText(text2, 0, 0);
              ctx.restore();
            } else
              ctx.fillText(text2, x3, y5 + j3 * lineHeight);
          }
        }
      }
      if (ticks2.show) {
        drawOrthoLines(
          canOffs,
          ticks2.filter(self, splits, i4, _space, incr),
          ori,
          side,
          basePos,
          tickSize,
          roundDec(ticks2.width * pxRatio, 3),
          ticks2.stroke(self, i4),
          ticks2.dash,
          ticks2.cap
        );
      }
      let grid2 = axis.grid;
      if (grid2.show) {
        drawOrthoLines(
          canOffs,
          grid2.filter(self, splits, i4, _space, incr),
          ori,
          ori == 0 ? 2 : 1,
          ori == 0 ? plotTop : plotLft,
          ori == 0 ? plotHgt : plotWid,
          roundDec(grid2.width * pxRatio, 3),
          grid2.stroke(self, i4),
          grid2.dash,
          grid2.cap
        );
      }
      if (border2.show) {
        drawOrthoLines(
          [basePos],
          [1],
          ori == 0 ? 1 : 0,
          ori == 0 ? 1 : 2,
          ori == 1 ? plotTop : plotLft,
          ori == 1 ? plotHgt : plotWid,
          roundDec(border2.width * pxRatio, 3),
          border2.stroke(self, i4),
          border2.dash,
          border2.cap
        );
      }
    }
    fire("drawAxes");
  }
  function resetYSeries(minMax) {
    series.forEach((s4, i4) => {
      if (i4 > 0) {
        s4._paths = null;
        if (minMax) {
          if (mode == 1) {
            s4.min = null;
            s4.max = null;
          } else {
            s4.facets.forEach((f5) => {
              f5.min = null;
              f5.max = null;
            });
          }
        }
      }
    });
  }
  let queuedCommit = false;
  let deferHooks = false;
  let hooksQueue = [];
  function flushHooks() {
    deferHooks = false;
    for (let i4 = 0; i4 < hooksQueue.length; i4++)
      fire(...hooksQueue[i4]);
    hooksQueue.length = 0;
  }
  function commit() {
    if (!queuedCommit) {
      microTask(_commit);
      queuedCommit = true;
    }
  }
  function batch(fn, _deferHooks = false) {
    queuedCommit = true;
    deferHooks = _deferHooks;
    fn(self);
    _commit();
    if (_deferHooks && hooksQueue.length > 0)
      queueMicrotask(flushHooks);
  }
  self.batch = batch;
  function _commit() {
    if (shouldSetScales) {
      setScales();
      shouldSetScales = false;
    }
    if (shouldConvergeSize) {
      convergeSize();
      shouldConvergeSize = false;
    }
    if (shouldSetSize) {
      setStylePx(under, LEFT, plotLftCss);
      setStylePx(under, TOP2, plotTopCss);
      setStylePx(under, WIDTH3, plotWidCss);
      setStylePx(under, HEIGHT, plotHgtCss);
      setStylePx(over, LEFT, plotLftCss);
      setStylePx(over, TOP2, plotTopCss);
      setStylePx(over, WIDTH3, plotWidCss);
      setStylePx(over, HEIGHT, plotHgtCss);
      setStylePx(wrap, WIDTH3, fullWidCss);
      setStylePx(wrap, HEIGHT, fullHgtCss);
      can.width = round(fullWidCss * pxRatio);
      can.height = round(fullHgtCss * pxRatio);
      axes.forEach(({ _el, _show, _size, _pos, side }) => {
        if (_el != null) {
          if (_show) {
            let posOffset = side === 3 || side === 0 ? _size : 0;
            let isVt = side % 2 == 1;
            setStylePx(_el, isVt ? "left" : "top", _pos - posOffset);
            setStylePx(_el, isVt ? "width" : "height", _size);
            setStylePx(_el, isVt ? "top" : "left", isVt ? plotTopCss : plotLftCss);
            setStylePx(_el, isVt ? "height" : "width", isVt ? plotHgtCss : plotWidCss);
            remClass(_el, OFF);
          } else
            addClass(_el, OFF);
        }
      });
      ctxStroke = ctxFill = ctxWidth = ctxJoin = ctxCap = ctxFont = ctxAlign = ctxBaseline = ctxDash = null;
      ctxAlpha = 1;
      syncRect(true);
      if (plotLftCss != _plotLftCss || plotTopCss != _plotTopCss || plotWidCss != _plotWidCss || plotHgtCss != _plotHgtCss) {
        resetYSeries(false);
        let pctWid = plotWidCss / _plotWidCss;
        let pctHgt = plotHgtCss / _plotHgtCss;
        if (showCursor && !shouldSetCursor && cursor.left >= 0) {
          cursor.left *= pctWid;
          cursor.top *= pctHgt;
          vCursor && elTrans(vCursor, round(cursor.left), 0, plotWidCss, plotHgtCss);
          hCursor && elTrans(hCursor, 0, round(cursor.top), plotWidCss, plotHgtCss);
          for (let i4 = 0; i4 < cursorPts.length; i4++) {
            let pt = cursorPts[i4];
            if (pt != null) {
              cursorPtsLft[i4] *= pctWid;
              cursorPtsTop[i4] *= pctHgt;
              elTrans(pt, ceil(cursorPtsLft[i4]), ceil(cursorPtsTop[i4]), plotWidCss, plotHgtCss);
            }
          }
        }
        if (select.show && !shouldSetSelect && select.left >= 0 && select.width > 0) {
          select.left *= pctWid;
          select.width *= pctWid;
          select.top *= pctHgt;
          select.height *= pctHgt;
          for (let prop in _hideProps)
            setStylePx(selectDiv, prop, select[prop]);
        }
        _plotLftCss = plotLftCss;
        _plotTopCss = plotTopCss;
        _plotWidCss = plotWidCss;
        _plotHgtCss = plotHgtCss;
      }
      fire("setSize");
      shouldSetSize = false;
    }
    if (fullWidCss > 0 && fullHgtCss > 0) {
      ctx.clearRect(0, 0, can.width, can.height);
      fire("drawClear");
      drawOrder.forEach((fn) => fn());
      fire("draw");
    }
    if (select.show && shouldSetSelect) {
      setSelect(select);
      shouldSetSelect = false;
    }
    if (showCursor && shouldSetCursor) {
      updateCursor(null, true, false);
      shouldSetCursor = false;
    }
    if (legend.show && legend.live && shouldSetLegend) {
      setLegend();
      shouldSetLegend = false;
    }
    if (!ready) {
      ready = true;
      self.status = 1;
      fire("ready");
    }
    viaAutoScaleX = false;
    queuedCommit = false;
  }
  self.redraw = (rebuildPaths, recalcAxes) => {
    shouldConvergeSize = recalcAxes || false;
    if (rebuildPaths !== false)
      _setScale(xScaleKey, scaleX.min, scaleX.max);
    else
      commit();
  };
  function setScale(key2, opts2) {
    let sc = scales[key2];
    if (sc.from == null) {
      if (dataLen == 0) {
        let minMax = sc.range(self, opts2.min, opts2.max, key2);
        opts2.min = minMax[0];
        opts2.max = minMax[1];
      }
      if (opts2.min > opts2.max) {
        let _min = opts2.min;
        opts2.min = opts2.max;
        opts2.max = _min;
      }
      if (dataLen > 1 && opts2.min != null && opts2.max != null && opts2.max - opts2.min < 1e-16)
        return;
      if (key2 == xScaleKey) {
        if (sc.distr == 2 && dataLen > 0) {
          opts2.min = closestIdx(opts2.min, data[0]);
          opts2.max = closestIdx(opts2.max, data[0]);
          if (opts2.min == opts2.max)
            opts2.max++;
        }
      }
      pendScales[key2] = opts2;
      shouldSetScales = true;
      commit();
    }
  }
  self.setScale = setScale;
  let xCursor;
  let yCursor;
  let vCursor;
  let hCursor;
  let rawMouseLeft0;
  let rawMouseTop0;
  let mouseLeft0;
  let mouseTop0;
  let rawMouseLeft1;
  let rawMouseTop1;
  let mouseLeft1;
  let mouseTop1;
  let dragging = false;
  const drag2 = cursor.drag;
  let dragX = drag2.x;
  let dragY = drag2.y;
  if (showCursor) {
    if (cursor.x)
      xCursor = placeDiv(CURSOR_X, over);
    if (cursor.y)
      yCursor = placeDiv(CURSOR_Y, over);
    if (scaleX.ori == 0) {
      vCursor = xCursor;
      hCursor = yCursor;
    } else {
      vCursor = yCursor;
      hCursor = xCursor;
    }
    mouseLeft1 = cursor.left;
    mouseTop1 = cursor.top;
  }
  const select = self.select = assign({
    show: true,
    over: true,
    left: 0,
    width: 0,
    top: 0,
    height: 0
  }, opts.select);
  const selectDiv = select.show ? placeDiv(SELECT, select.over ? over : under) : null;
  function setSelect(opts2, _fire) {
    if (select.show) {
      for (let prop in opts2) {
        select[prop] = opts2[prop];
        if (prop in _hideProps)
          setStylePx(selectDiv, prop, opts2[prop]);
      }
      _fire !== false && fire("setSelect");
    }
  }
  self.setSelect = setSelect;
  function toggleDOM(i4) {
    let s4 = series[i4];
    if (s4.show)
      showLegend && remClass(legendRows[i4], OFF);
    else {
      showLegend && addClass(legendRows[i4], OFF);
      if (showCursor) {
        let pt = cursorOnePt ? cursorPts[0] : cursorPts[i4];
        pt != null && elTrans(pt, -10, -10, plotWidCss, plotHgtCss);
      }
    }
  }
  function _setScale(key2, min2, max2) {
    setScale(key2, { min: min2, max: max2 });
  }
  function setSeries(i4, opts2, _fire, _pub) {
    if (opts2.focus != null)
      setFocus(i4);
    if (opts2.show != null) {
      series.forEach((s4, si) => {
        if (si > 0 && (i4 == si || i4 == null)) {
          s4.show = opts2.show;
          toggleDOM(si);
          if (mode == 2) {
            _setScale(s4.facets[0].scale, null, null);
            _setScale(s4.facets[1].scale, null, null);
          } else
            _setScale(s4.scale, null, null);
          commit();
        }
      });
    }
    _fire !== false && fire("setSeries", i4, opts2);
    _pub && pubSync("setSeries", self, i4, opts2);
  }
  self.setSeries = setSeries;
  function setBand(bi, opts2) {
    assign(bands[bi], opts2);
  }
  function addBand(opts2, bi) {
    opts2.fill = fnOrSelf(opts2.fill || null);
    opts2.dir = ifNull(opts2.dir, -1);
    bi = bi == null ? bands.length : bi;
    bands.splice(bi, 0, opts2);
  }
  function delBand(bi) {
    if (bi == null)
      bands.length = 0;
    else
      bands.splice(bi, 1);
  }
  self.addBand = addBand;
  self.setBand = setBand;
  self.delBand = delBand;
  function setAlpha(i4, value) {
    series[i4].alpha = value;
    if (showCursor && cursorPts[i4] != null)
      cursorPts[i4].style.opacity = value;
    if (showLegend && legendRows[i4])
      legendRows[i4].style.opacity = value;
  }
  let closestDist;
  let closestSeries;
  let focusedSeries;
  const FOCUS_TRUE = { focus: true };
  function setFocus(i4) {
    if (i4 != focusedSeries) {
      let allFocused = i4 == null;
      let _setAlpha = focus.alpha != 1;
      series.forEach((s4, i22) => {
        if (mode == 1 || i22 > 0) {
          let isFocused = allFocused || i22 == 0 || i22 == i4;
          s4._focus = allFocused ? null : isFocused;
          _setAlpha && setAlpha(i22, isFocused ? 1 : focus.alpha);
        }
      });
      focusedSeries = i4;
      _setAlpha && commit();
    }
  }
  if (showLegend && cursorFocus) {
    onMouse(mouseleave, legendTable, (e4) => {
      if (cursor._lock)
        return;
      setCursorEvent(e4);
      if (focusedSeries != null)
        setSeries(null, FOCUS_TRUE, true, syncOpts.setSeries);
    });
  }
  function posToVal(pos, scale, can2) {
    let sc = scales[scale];
    if (can2)
      pos = pos / pxRatio - (sc.ori == 1 ? plotTopCss : plotLftCss);
    let dim = plotWidCss;
    if (sc.ori == 1) {
      dim = plotHgtCss;
      pos = dim - pos;
    }
    if (sc.dir == -1)
      pos = dim - pos;
    let _min = sc._min, _max = sc._max, pct = pos / dim;
    let sv = _min + (_max - _min) * pct;
    let distr = sc.distr;
    return distr == 3 ? pow(10, sv) : distr == 4 ? sinh(sv, sc.asinh) : distr == 100 ? sc.bwd(sv) : sv;
  }
  function closestIdxFromXpos(pos, can2) {
    let v4 = posToVal(pos, xScaleKey, can2);
    return closestIdx(v4, data[0], i0, i1);
  }
  self.valToIdx = (val) => closestIdx(val, data[0]);
  self.posToIdx = closestIdxFromXpos;
  self.posToVal = posToVal;
  self.valToPos = (val, scale, can2) => scales[scale].ori == 0 ? getHPos(
    val,
    scales[scale],
    can2 ? plotWid : plotWidCss,
    can2 ? plotLft : 0
  ) : getVPos(
    val,
    scales[scale],
    can2 ? plotHgt : plotHgtCss,
    can2 ? plotTop : 0
  );
  self.setCursor = (opts2, _fire, _pub) => {
    mouseLeft1 = opts2.left;
    mouseTop1 = opts2.top;
    updateCursor(null, _fire, _pub);
  };
  function setSelH(off2, dim) {
    setStylePx(selectDiv, LEFT, select.left = off2);
    setStylePx(selectDiv, WIDTH3, select.width = dim);
  }
  function setSelV(off2, dim) {
    setStylePx(selectDiv, TOP2, select.top = off2);
    setStylePx(selectDiv, HEIGHT, select.height = dim);
  }
  let setSelX = scaleX.ori == 0 ? setSelH : setSelV;
  let setSelY = scaleX.ori == 1 ? setSelH : setSelV;
  function syncLegend() {
    if (showLegend && legend.live) {
      for (let i4 = mode == 2 ? 1 : 0; i4 < series.length; i4++) {
        if (i4 == 0 && multiValLegend)
          continue;
        let vals = legend.values[i4];
        let j3 = 0;
        for (let k4 in vals)
          legendCells[i4][j3++].firstChild.nodeValue = vals[k4];
      }
    }
  }
  function setLegend(opts2, _fire) {
    if (opts2 != null) {
      if (opts2.idxs) {
        opts2.idxs.forEach((didx, sidx) => {
          activeIdxs[sidx] = didx;
        });
      } else if (!isUndef(opts2.idx))
        activeIdxs.fill(opts2.idx);
      legend.idx = activeIdxs[0];
    }
    if (showLegend && legend.live) {
      for (let sidx = 0; sidx < series.length; sidx++) {
        if (sidx > 0 || mode == 1 && !multiValLegend)
          setLegendValues(sidx, activeIdxs[sidx]);
      }
      syncLegend();
    }
    shouldSetLegend = false;
    _fire !== false && fire("setLegend");
  }
  self.setLegend = setLegend;
  function setLegendValues(sidx, idx) {
    let s4 = series[sidx];
    let src = sidx == 0 && xScaleDistr == 2 ? data0 : data[sidx];
    let val;
    if (multiValLegend)
      val = s4.values(self, sidx, idx) ?? NULL_LEGEND_VALUES;
    else {
      val = s4.value(self, idx == null ? null : src[idx], sidx, idx);
      val = val == null ? NULL_LEGEND_VALUES : { _: val };
    }
    legend.values[sidx] = val;
  }
  function updateCursor(src, _fire, _pub) {
    rawMouseLeft1 = mouseLeft1;
    rawMouseTop1 = mouseTop1;
    [mouseLeft1, mouseTop1] = cursor.move(self, mouseLeft1, mouseTop1);
    cursor.left = mouseLeft1;
    cursor.top = mouseTop1;
    if (showCursor) {
      vCursor && elTrans(vCursor, round(mouseLeft1), 0, plotWidCss, plotHgtCss);
      hCursor && elTrans(hCursor, 0, round(mouseTop1), plotWidCss, plotHgtCss);
    }
    let idx;
    let noDataInRange = i0 > i1;
    closestDist = inf;
    closestSeries = null;
    let xDim = scaleX.ori == 0 ? plotWidCss : plotHgtCss;
    let yDim = scaleX.ori == 1 ? plotWidCss : plotHgtCss;
    if (mouseLeft1 < 0 || dataLen == 0 || noDataInRange) {
      idx = cursor.idx = null;
      for (let i4 = 0; i4 < series.length; i4++) {
        let pt = cursorPts[i4];
        pt != null && elTrans(pt, -10, -10, plotWidCss, plotHgtCss);
      }
      if (cursorFocus)
        setSeries(null, FOCUS_TRUE, true, src == null && syncOpts.setSeries);
      if (legend.live) {
        activeIdxs.fill(idx);
        shouldSetLegend = true;
      }
    } else {
      let mouseXPos, valAtPosX, xPos;
      if (mode == 1) {
        mouseXPos = scaleX.ori == 0 ? mouseLeft1 : mouseTop1;
        valAtPosX = posToVal(mouseXPos, xScaleKey);
        idx = cursor.idx = closestIdx(valAtPosX, data[0], i0, i1);
        xPos = valToPosX(data[0][idx], scaleX, xDim, 0);
      }
      let _ptLft = -10;
      let _ptTop = -10;
      let _ptWid = 0;
      let _ptHgt = 0;
      let _centered = true;
      let _ptFill = "";
      let _ptStroke = "";
      for (let i4 = mode == 2 ? 1 : 0; i4 < series.length; i4++) {
        let s4 = series[i4];
        let idx1 = activeIdxs[i4];
        let yVal1 = idx1 == null ? null : mode == 1 ? data[i4][idx1] : data[i4][1][idx1];
        let idx2 = cursor.dataIdx(self, i4, idx, valAtPosX);
        let yVal2 = idx2 == null ? null : mode == 1 ? data[i4][idx2] : data[i4][1][idx2];
        shouldSetLegend = shouldSetLegend || yVal2 != yVal1 || idx2 != idx1;
        activeIdxs[i4] = idx2;
        if (i4 > 0 && s4.show) {
          let xPos2 = idx2 == null ? -10 : idx2 == idx ? xPos : valToPosX(mode == 1 ? data[0][idx2] : data[i4][0][idx2], scaleX, xDim, 0);
          let yPos = yVal2 == null ? -10 : valToPosY(yVal2, mode == 1 ? scales[s4.scale] : scales[s4.facets[1].scale], yDim, 0);
          if (cursorFocus && yVal2 != null) {
            let mouseYPos = scaleX.ori == 1 ? mouseLeft1 : mouseTop1;
            let dist = abs(focus.dist(self, i4, idx2, yPos, mouseYPos));
            if (dist < closestDist) {
              let bias = focus.bias;
              if (bias != 0) {
                let mouseYVal = posToVal(mouseYPos, s4.scale);
                let seriesYValSign = yVal2 >= 0 ? 1 : -1;
                let mouseYValSign = mouseYVal >= 0 ? 1 : -1;
                if (mouseYValSign == seriesYValSign && (mouseYValSign == 1 ? bias == 1 ? yVal2 >= mouseYVal : yVal2 <= mouseYVal : (
                  // >= 0
                  bias == 1 ? yVal2 <= mouseYVal : yVal2 >= mouseYVal
                ))) {
                  closestDist = dist;
                  closestSeries = i4;
                }
              } else {
                closestDist = dist;
                closestSeries = i4;
              }
            }
          }
          if (shouldSetLegend || cursorOnePt) {
            let hPos, vPos;
            if (scaleX.ori == 0) {
              hPos = xPos2;
              vPos = yPos;
            } else {
              hPos = yPos;
              vPos = xPos2;
            }
            let ptWid, ptHgt, ptLft, ptTop, ptStroke, ptFill, centered = true, getBBox = points2.bbox;
            if (getBBox != null) {
              centered = false;
              let bbox = getBBox(self, i4);
              ptLft = bbox.left;
              ptTop = bbox.top;
              ptWid = bbox.width;
              ptHgt = bbox.height;
            } else {
              ptLft = hPos;
              ptTop = vPos;
              ptWid = ptHgt = points2.size(self, i4);
            }
            ptFill = points2.fill(self, i4);
            ptStroke = points2.stroke(self, i4);
            if (cursorOnePt) {
              if (i4 == closestSeries && closestDist <= focus.prox) {
                _ptLft = ptLft;
                _ptTop = ptTop;
                _ptWid = ptWid;
                _ptHgt = ptHgt;
                _centered = centered;
                _ptFill = ptFill;
                _ptStroke = ptStroke;
              }
            } else {
              let pt = cursorPts[i4];
              if (pt != null) {
                cursorPtsLft[i4] = ptLft;
                cursorPtsTop[i4] = ptTop;
                elSize(pt, ptWid, ptHgt, centered);
                elColor(pt, ptFill, ptStroke);
                elTrans(pt, ceil(ptLft), ceil(ptTop), plotWidCss, plotHgtCss);
              }
            }
          }
        }
      }
      if (cursorOnePt) {
        let p5 = focus.prox;
        let focusChanged = focusedSeries == null ? closestDist <= p5 : closestDist > p5 || closestSeries != focusedSeries;
        if (shouldSetLegend || focusChanged) {
          let pt = cursorPts[0];
          if (pt != null) {
            cursorPtsLft[0] = _ptLft;
            cursorPtsTop[0] = _ptTop;
            elSize(pt, _ptWid, _ptHgt, _centered);
            elColor(pt, _ptFill, _ptStroke);
            elTrans(pt, ceil(_ptLft), ceil(_ptTop), plotWidCss, plotHgtCss);
          }
        }
      }
    }
    if (select.show && dragging) {
      if (src != null) {
        let [xKey, yKey] = syncOpts.scales;
        let [matchXKeys, matchYKeys] = syncOpts.match;
        let [xKeySrc, yKeySrc] = src.cursor.sync.scales;
        let sdrag = src.cursor.drag;
        dragX = sdrag._x;
        dragY = sdrag._y;
        if (dragX || dragY) {
          let { left, top, width, height } = src.select;
          let sori = src.scales[xKeySrc].ori;
          let sPosToVal = src.posToVal;
          let sOff, sDim, sc, a5, b3;
          let matchingX = xKey != null && matchXKeys(xKey, xKeySrc);
          let matchingY = yKey != null && matchYKeys(yKey, yKeySrc);
          if (matchingX && dragX) {
            if (sori == 0) {
              sOff = left;
              sDim = width;
            } else {
              sOff = top;
              sDim = height;
            }
            sc = scales[xKey];
            a5 = valToPosX(sPosToVal(sOff, xKeySrc), sc, xDim, 0);
            b3 = valToPosX(sPosToVal(sOff + sDim, xKeySrc), sc, xDim, 0);
            setSelX(min(a5, b3), abs(b3 - a5));
          } else
            setSelX(0, xDim);
          if (matchingY && dragY) {
            if (sori == 1) {
              sOff = left;
              sDim = width;
            } else {
              sOff = top;
              sDim = height;
            }
            sc = scales[yKey];
            a5 = valToPosY(sPosToVal(sOff, yKeySrc), sc, yDim, 0);
            b3 = valToPosY(sPosToVal(sOff + sDim, yKeySrc), sc, yDim, 0);
            setSelY(min(a5, b3), abs(b3 - a5));
          } else
            setSelY(0, yDim);
        } else
          hideSelect();
      } else {
        let rawDX = abs(rawMouseLeft1 - rawMouseLeft0);
        let rawDY = abs(rawMouseTop1 - rawMouseTop0);
        if (scaleX.ori == 1) {
          let _rawDX = rawDX;
          rawDX = rawDY;
          rawDY = _rawDX;
        }
        dragX = drag2.x && rawDX >= drag2.dist;
        dragY = drag2.y && rawDY >= drag2.dist;
        let uni = drag2.uni;
        if (uni != null) {
          if (dragX && dragY) {
            dragX = rawDX >= uni;
            dragY = rawDY >= uni;
            if (!dragX && !dragY) {
              if (rawDY > rawDX)
                dragY = true;
              else
                dragX = true;
            }
          }
        } else if (drag2.x && drag2.y && (dragX || dragY))
          dragX = dragY = true;
        let p0, p1;
        if (dragX) {
          if (scaleX.ori == 0) {
            p0 = mouseLeft0;
            p1 = mouseLeft1;
          } else {
            p0 = mouseTop0;
            p1 = mouseTop1;
          }
          setSelX(min(p0, p1), abs(p1 - p0));
          if (!dragY)
            setSelY(0, yDim);
        }
        if (dragY) {
          if (scaleX.ori == 1) {
            p0 = mouseLeft0;
            p1 = mouseLeft1;
          } else {
            p0 = mouseTop0;
            p1 = mouseTop1;
          }
          setSelY(min(p0, p1), abs(p1 - p0));
          if (!dragX)
            setSelX(0, xDim);
        }
        if (!dragX && !dragY) {
          setSelX(0, 0);
          setSelY(0, 0);
        }
      }
    }
    drag2._x = dragX;
    drag2._y = dragY;
    if (src == null) {
      if (_pub) {
        if (syncKey != null) {
          let [xSyncKey, ySyncKey] = syncOpts.scales;
          syncOpts.values[0] = xSyncKey != null ? posToVal(scaleX.ori == 0 ? mouseLeft1 : mouseTop1, xSyncKey) : null;
          syncOpts.values[1] = ySyncKey != null ? posToVal(scaleX.ori == 1 ? mouseLeft1 : mouseTop1, ySyncKey) : null;
        }
        pubSync(mousemove, self, mouseLeft1, mouseTop1, plotWidCss, plotHgtCss, idx);
      }
      if (cursorFocus) {
        let shouldPub = _pub && syncOpts.setSeries;
        let p5 = focus.prox;
        if (focusedSeries == null) {
          if (closestDist <= p5)
            setSeries(closestSeries, FOCUS_TRUE, true, shouldPub);
        } else {
          if (closestDist > p5)
            setSeries(null, FOCUS_TRUE, true, shouldPub);
          else if (closestSeries != focusedSeries)
            setSeries(closestSeries, FOCUS_TRUE, true, shouldPub);
        }
      }
    }
    if (shouldSetLegend) {
      legend.idx = idx;
      setLegend();
    }
    _fire !== false && fire("setCursor");
  }
  let rect2 = null;
  Object.defineProperty(self, "rect", {
    get() {
      if (rect2 == null)
        syncRect(false);
      return rect2;
    }
  });
  function syncRect(defer = false) {
    if (defer)
      rect2 = null;
    else {
      rect2 = over.getBoundingClientRect();
      fire("syncRect", rect2);
    }
  }
  function mouseMove(e4, src, _l, _t, _w, _h, _i) {
    if (cursor._lock)
      return;
    if (dragging && e4 != null && e4.movementX == 0 && e4.movementY == 0)
      return;
    cacheMouse(e4, src, _l, _t, _w, _h, _i, false, e4 != null);
    if (e4 != null)
      updateCursor(null, true, true);
    else
      updateCursor(src, true, false);
  }
  function cacheMouse(e4, src, _l, _t, _w, _h, _i, initial, snap) {
    if (rect2 == null)
      syncRect(false);
    setCursorEvent(e4);
    if (e4 != null) {
      _l = e4.clientX - rect2.left;
      _t = e4.clientY - rect2.top;
    } else {
      if (_l < 0 || _t < 0) {
        mouseLeft1 = -10;
        mouseTop1 = -10;
        return;
      }
      let [xKey, yKey] = syncOpts.scales;
      let syncOptsSrc = src.cursor.sync;
      let [xValSrc, yValSrc] = syncOptsSrc.values;
      let [xKeySrc, yKeySrc] = syncOptsSrc.scales;
      let [matchXKeys, matchYKeys] = syncOpts.match;
      let rotSrc = src.axes[0].side % 2 == 1;
      let xDim = scaleX.ori == 0 ? plotWidCss : plotHgtCss, yDim = scaleX.ori == 1 ? plotWidCss : plotHgtCss, _xDim = rotSrc ? _h : _w, _yDim = rotSrc ? _w : _h, _xPos = rotSrc ? _t : _l, _yPos = rotSrc ? _l : _t;
      if (xKeySrc != null)
        _l = matchXKeys(xKey, xKeySrc) ? getPos(xValSrc, scales[xKey], xDim, 0) : -10;
      else
        _l = xDim * (_xPos / _xDim);
      if (yKeySrc != null)
        _t = matchYKeys(yKey, yKeySrc) ? getPos(yValSrc, scales[yKey], yDim, 0) : -10;
      else
        _t = yDim * (_yPos / _yDim);
      if (scaleX.ori == 1) {
        let __l = _l;
        _l = _t;
        _t = __l;
      }
    }
    if (snap && (src == null || src.cursor.event.type == mousemove)) {
      if (_l <= 1 || _l >= plotWidCss - 1)
        _l = incrRound(_l, plotWidCss);
      if (_t <= 1 || _t >= plotHgtCss - 1)
        _t = incrRound(_t, plotHgtCss);
    }
    if (initial) {
      rawMouseLeft0 = _l;
      rawMouseTop0 = _t;
      [mouseLeft0, mouseTop0] = cursor.move(self, _l, _t);
    } else {
      mouseLeft1 = _l;
      mouseTop1 = _t;
    }
  }
  const _hideProps = {
    width: 0,
    height: 0,
    left: 0,
    top: 0
  };
  function hideSelect() {
    setSelect(_hideProps, false);
  }
  let downSelectLeft;
  let downSelectTop;
  let downSelectWidth;
  let downSelectHeight;
  function mouseDown(e4, src, _l, _t, _w, _h, _i) {
    dragging = true;
    dragX = dragY = drag2._x = drag2._y = false;
    cacheMouse(e4, src, _l, _t, _w, _h, _i, true, false);
    if (e4 != null) {
      onMouse(mouseup, doc, mouseUp, false);
      pubSync(mousedown, self, mouseLeft0, mouseTop0, plotWidCss, plotHgtCss, null);
    }
    let { left, top, width, height } = select;
    downSelectLeft = left;
    downSelectTop = top;
    downSelectWidth = width;
    downSelectHeight = height;
  }
  function mouseUp(e4, src, _l, _t, _w, _h, _i) {
    dragging = drag2._x = drag2._y = false;
    cacheMouse(e4, src, _l, _t, _w, _h, _i, false, true);
    let { left, top, width, height } = select;
    let hasSelect = width > 0 || height > 0;
    let chgSelect = downSelectLeft != left || downSelectTop != top || downSelectWidth != width || downSelectHeight != height;
    hasSelect && chgSelect && setSelect(select);
    if (drag2.setScale && hasSelect && chgSelect) {
      let xOff = left, xDim = width, yOff = top, yDim = height;
      if (scaleX.ori == 1) {
        xOff = top, xDim = height, yOff = left, yDim = width;
      }
      if (dragX) {
        _setScale(
          xScaleKey,
          posToVal(xOff, xScaleKey),
          posToVal(xOff + xDim, xScaleKey)
        );
      }
      if (dragY) {
        for (let k4 in scales) {
          let sc = scales[k4];
          if (k4 != xScaleKey && sc.from == null && sc.min != inf) {
            _setScale(
              k4,
              posToVal(yOff + yDim, k4),
              posToVal(yOff, k4)
            );
          }
        }
      }
      hideSelect();
    } else if (cursor.lock) {
      cursor._lock = !cursor._lock;
      updateCursor(src, true, e4 != null);
    }
    if (e4 != null) {
      offMouse(mouseup, doc);
      pubSync(mouseup, self, mouseLeft1, mouseTop1, plotWidCss, plotHgtCss, null);
    }
  }
  function mouseLeave(e4, src, _l, _t, _w, _h, _i) {
    if (cursor._lock)
      return;
    setCursorEvent(e4);
    let _dragging = dragging;
    if (dragging) {
      let snapH = true;
      let snapV = true;
      let snapProx = 10;
      let dragH, dragV;
      if (scaleX.ori == 0) {
        dragH = dragX;
        dragV = dragY;
      } else {
        dragH = dragY;
        dragV = dragX;
      }
      if (dragH && dragV) {
        snapH = mouseLeft1 <= snapProx || mouseLeft1 >= plotWidCss - snapProx;
        snapV = mouseTop1 <= snapProx || mouseTop1 >= plotHgtCss - snapProx;
      }
      if (dragH && snapH)
        mouseLeft1 = mouseLeft1 < mouseLeft0 ? 0 : plotWidCss;
      if (dragV && snapV)
        mouseTop1 = mouseTop1 < mouseTop0 ? 0 : plotHgtCss;
      updateCursor(null, true, true);
      dragging = false;
    }
    mouseLeft1 = -10;
    mouseTop1 = -10;
    activeIdxs.fill(null);
    updateCursor(null, true, true);
    if (_dragging)
      dragging = _dragging;
  }
  function dblClick(e4, src, _l, _t, _w, _h, _i) {
    if (cursor._lock)
      return;
    setCursorEvent(e4);
    autoScaleX();
    hideSelect();
    if (e4 != null)
      pubSync(dblclick, self, mouseLeft1, mouseTop1, plotWidCss, plotHgtCss, null);
  }
  function syncPxRatio() {
    axes.forEach(syncFontSize);
    _setSize(self.width, self.height, true);
  }
  on(dppxchange, win, syncPxRatio);
  const events = {};
  events.mousedown = mouseDown;
  events.mousemove = mouseMove;
  events.mouseup = mouseUp;
  events.dblclick = dblClick;
  events["setSeries"] = (e4, src, idx, opts2) => {
    let seriesIdxMatcher2 = syncOpts.match[2];
    idx = seriesIdxMatcher2(self, src, idx);
    idx != -1 && setSeries(idx, opts2, true, false);
  };
  if (showCursor) {
    onMouse(mousedown, over, mouseDown);
    onMouse(mousemove, over, mouseMove);
    onMouse(mouseenter, over, (e4) => {
      setCursorEvent(e4);
      syncRect(false);
    });
    onMouse(mouseleave, over, mouseLeave);
    onMouse(dblclick, over, dblClick);
    cursorPlots.add(self);
    self.syncRect = syncRect;
  }
  const hooks = self.hooks = opts.hooks || {};
  function fire(evName, a1, a22) {
    if (deferHooks)
      hooksQueue.push([evName, a1, a22]);
    else {
      if (evName in hooks) {
        hooks[evName].forEach((fn) => {
          fn.call(null, self, a1, a22);
        });
      }
    }
  }
  (opts.plugins || []).forEach((p5) => {
    for (let evName in p5.hooks)
      hooks[evName] = (hooks[evName] || []).concat(p5.hooks[evName]);
  });
  const seriesIdxMatcher = (self2, src, srcSeriesIdx) => srcSeriesIdx;
  const syncOpts = assign({
    key: null,
    setSeries: false,
    filters: {
      pub: retTrue,
      sub: retTrue
    },
    scales: [xScaleKey, series[1] ? series[1].scale : null],
    match: [retEq, retEq, seriesIdxMatcher],
    values: [null, null]
  }, cursor.sync);
  if (syncOpts.match.length == 2)
    syncOpts.match.push(seriesIdxMatcher);
  cursor.sync = syncOpts;
  const syncKey = syncOpts.key;
  const sync = _sync(syncKey);
  function pubSync(type, src, x3, y5, w5, h5, i4) {
    if (syncOpts.filters.pub(type, src, x3, y5, w5, h5, i4))
      sync.pub(type, src, x3, y5, w5, h5, i4);
  }
  sync.sub(self);
  function pub(type, src, x3, y5, w5, h5, i4) {
    if (syncOpts.filters.sub(type, src, x3, y5, w5, h5, i4))
      events[type](null, src, x3, y5, w5, h5, i4);
  }
  self.pub = pub;
  function destroy() {
    sync.unsub(self);
    cursorPlots.delete(self);
    mouseListeners.clear();
    off(dppxchange, win, syncPxRatio);
    root.remove();
    legendTable?.remove();
    fire("destroy");
  }
  self.destroy = destroy;
  function _init() {
    fire("init", opts, data);
    setData(data || opts.data, false);
    if (pendScales[xScaleKey])
      setScale(xScaleKey, pendScales[xScaleKey]);
    else
      autoScaleX();
    shouldSetSelect = select.show && (select.width > 0 || select.height > 0);
    shouldSetCursor = shouldSetLegend = true;
    _setSize(opts.width, opts.height);
  }
  series.forEach(initSeries);
  axes.forEach(initAxis);
  if (then) {
    if (then instanceof HTMLElement) {
      then.appendChild(root);
      _init();
    } else
      then(self, _init);
  } else
    _init();
  return self;
}
uPlot.assign = assign;
uPlot.fmtNum = fmtNum;
uPlot.rangeNum = rangeNum;
uPlot.rangeLog = rangeLog;
uPlot.rangeAsinh = rangeAsinh;
uPlot.orient = orient;
uPlot.pxRatio = pxRatio;
{
  uPlot.join = join;
}
{
  uPlot.fmtDate = fmtDate;
  uPlot.tzDate = tzDate;
}
uPlot.sync = _sync;
{
  uPlot.addGap = addGap;
  uPlot.clipGaps = clipGaps;
  let paths = uPlot.paths = {
    points
  };
  paths.linear = linear;
  paths.stepped = stepped;
  paths.bars = bars;
  paths.spline = monotoneCubic;
}

// src/drawing/plot.ts
var SCALE = 44;
var RIGHT4 = 14;
var Plot = class {
  element;
  samples;
  chart;
  range = { from: 0, to: 1 };
  #axis = new Axis([], { from: 0, to: 1 }, 0, 1);
  // of its drawing, from its left
  #colours = new Colours();
  /** @param ids of series */
  constructor(element, ids, unit) {
    this.element = element;
    this.samples = ids.map((id) => new Samples(id));
    const colour = (name) => () => this.#colours.of(name);
    const paths = { linear: uPlot.paths.linear?.(), stepped: uPlot.paths.stepped?.({ align: 1 }) };
    const lines = this.samples.map(({ isStep }, i4) => ({
      stroke: colour(`s${i4 + 1}`),
      width: 1.75,
      paths: isStep ? paths.stepped : paths.linear,
      points: { size: 4 },
      gaps: breaksOf
    }));
    const percent2 = unit === "%";
    this.chart = new uPlot(
      {
        width: Math.max(1, element.clientWidth),
        height: Math.max(1, element.clientHeight),
        padding: [6, RIGHT4, 6, 0],
        cursor: { show: false },
        legend: { show: false },
        scales: {
          x: { time: false, auto: false, distr: 100, fwd: (t4) => this.#axis.x(t4), bwd: (px) => this.#axis.timeAt(px) },
          y: percent2 ? { range: [0, 100] } : {}
        },
        axes: [
          { show: false },
          {
            size: SCALE,
            gap: 4,
            font: FONT,
            space: 24,
            stroke: colour("muted"),
            grid: { stroke: colour("hair"), width: 1 },
            ticks: { show: false }
          }
        ],
        series: [{}, ...lines],
        hooks: { draw: [() => this.#marks()] }
      },
      aligned([], 0, 1, 0),
      element
    );
    element.addEventListener("pointerdown", (e4) => this.#down(e4));
    element.addEventListener("pointermove", (e4) => {
      store.pointer.pointed.value = this.#timeAt(e4);
    });
    element.addEventListener("pointerleave", () => {
      store.pointer.pointed.value = null;
    });
  }
  destroy() {
    this.chart.destroy();
  }
  restyle() {
    this.#colours.forget();
  }
  draw(range) {
    const { chart, element } = this;
    const [width, height] = [element.clientWidth, element.clientHeight];
    if (!width || !height) return;
    this.range = range;
    this.#axis = new Axis(store.clock.folds(), range, 0, Math.max(1, width - SCALE - RIGHT4));
    for (const one of this.samples) one.update(store.data.run, store.data.scene.series);
    if (chart.width !== width || chart.height !== height) chart.setSize({ width, height });
    chart.batch(() => {
      chart.setData(aligned(this.samples, range.from, range.to, store.playback.nowMs()), false);
      chart.setScale("x", { min: range.from, max: range.to });
    });
  }
  /** Mark the instants shown and at the pointer and the hovered visit; the time after the instant shown is pale. */
  #marks() {
    const { ctx: g5, bbox } = this.chart;
    const at = (t4) => bbox.left + this.#axis.x(t4) / this.#axis.right * bbox.width;
    const within3 = (px) => Math.max(bbox.left, Math.min(px, bbox.left + bbox.width));
    const band = (from, to, name, part = 1) => {
      g5.globalAlpha = part;
      g5.fillStyle = this.#colours.of(name);
      g5.fillRect(within3(from), bbox.top, Math.max(0, within3(to) - within3(from)), bbox.height);
    };
    const ratio = devicePixelRatio || 1;
    g5.save();
    for (const fold of this.#axis.folds) band(at(fold.from), at(fold.to), "depth2");
    const span = store.pointer.hoveredSpan();
    if (span) band(at(span.from), at(span.to ?? store.playback.nowMs()), "halo", 0.22);
    const stretch = store.playback.stretch.value;
    if (stretch) band(at(stretch.from), at(stretch.to), "ink", 0.1);
    if (store.playback.cursor.value !== null) {
      band(at(store.playback.cursor.value), bbox.left + bbox.width, "background", 0.55);
      band(at(store.playback.cursor.value) - ratio, at(store.playback.cursor.value) + ratio, "active");
    }
    if (store.pointer.pointed.value !== null)
      band(at(store.pointer.pointed.value), at(store.pointer.pointed.value) + ratio, "muted");
    g5.restore();
  }
  #timeAt(e4) {
    const { left, width } = this.chart.over.getBoundingClientRect();
    return this.#axis.timeAt(Math.max(0, Math.min(1, (e4.clientX - left) / width)) * this.#axis.right);
  }
  #down(e4) {
    if (e4.button !== 0) return;
    const seek = (m5) => store.playback.seek(this.#timeAt(m5));
    seek(e4);
    drag(seek);
  }
};
function breaksOf(chart, number, first, last) {
  const instants2 = chart.data[0];
  const values = chart.data[number];
  const ratio = devicePixelRatio || 1;
  const breaks = [];
  let before = -1;
  let isBroken = false;
  for (let i4 = first; i4 <= last; i4++) {
    if (values[i4] === null) isBroken = true;
    if (typeof values[i4] !== "number") continue;
    if (isBroken && before >= 0) {
      const [from, to] = [before, i4].map((at) => chart.valToPos(instants2[at], "x", true));
      breaks.push([from, Math.max(to, from + ratio)]);
    }
    isBroken = false;
    before = i4;
  }
  return breaks;
}

// src/panels/plots.tsx
var GROUPS = [
  ["topic", "topics"],
  ["progress", "goals"],
  ["userdata", "userdata"],
  ["feedback", "feedback"]
];
var unitFor = (origin) => origin.source === "topic" ? store.data.scene.series.get(origin.owner)?.unit ?? "" : unitOf(origin);
function PlotsPanel({ page: page2 }) {
  const plots = store.panels.plotsShown.value;
  return /* @__PURE__ */ a4("section", { class: `plots ${plots.length ? "" : "none"}`, "aria-label": "plots", children: plots.map((ids, i4) => /* @__PURE__ */ a4(PlotRow, { page: page2, ids, number: i4 }, ids.join(" "))) });
}
function PlotRow({ page: page2, ids, number }) {
  const place = T2(null);
  const origins = ids.map((id) => originOf(id));
  const unit = unitFor(origins[0]);
  F2(() => {
    if (!place.current) return void 0;
    const plot = new Plot(place.current, ids, unit);
    page2.addPlot(plot);
    return () => page2.removePlot(plot);
  }, [ids.join(" "), unit]);
  return /* @__PURE__ */ a4("div", { class: "plot", children: [
    /* @__PURE__ */ a4("ul", { class: "plot-names", children: [
      origins.map((origin, i4) => /* @__PURE__ */ a4(
        Line,
        {
          origin,
          label: namesOf(origins)[i4],
          colour: i4,
          onRemove: () => store.panels.removeLine(number, ids[i4])
        },
        ids[i4]
      )),
      /* @__PURE__ */ a4("li", { children: /* @__PURE__ */ a4(AddLine, { label: "add a line to this plot", text: "+", onPick: (id) => store.panels.addLine(number, id) }) })
    ] }),
    /* @__PURE__ */ a4("div", { class: "plot-area", ref: place })
  ] });
}
function namesOf(origins) {
  const labels = origins.map(labelOf);
  const isRepeated = (label) => labels.indexOf(label) < labels.lastIndexOf(label);
  return labels.map((label, i4) => isRepeated(label) ? `${ownerOf(origins[i4])} ${label}` : label);
}
function Line({
  origin,
  label,
  colour,
  onRemove
}) {
  store.playback.watch();
  const samples = T2(null);
  samples.current ??= new Samples(idOf(origin));
  const list = samples.current.update(store.data.run, store.data.scene.series);
  const value = valueAt(list, store.pointer.pointed.value ?? store.playback.nowMs());
  const nothing = list.length ? "–" : "no values yet";
  const text2 = value === null ? nothing : `${numberText(value)} ${unitFor(origin)}`.trim();
  const title = [labelOf(origin), ownerOf(origin)].filter(Boolean).join(", ");
  return /* @__PURE__ */ a4("li", { title: shorten(title, 200), children: [
    /* @__PURE__ */ a4("i", { class: `line s${colour + 1}` }),
    /* @__PURE__ */ a4("span", { class: "plot-name", children: shorten(label, 40) }),
    /* @__PURE__ */ a4("button", { class: "remove", "aria-label": `remove ${label} from the plots`, onClick: onRemove, children: "✕" }),
    /* @__PURE__ */ a4("output", { children: text2 })
  ] });
}
function AddLine({ label, text: text2, onPick }) {
  const [found, setFound] = d2([]);
  const look = () => {
    const shown = new Set(store.panels.plotsShown.value.flat());
    const all = originsIn(store.playback.shown(), store.data.scene.series.keys());
    setFound(all.filter((one) => !shown.has(idOf(one))));
  };
  const onChange = (e4) => {
    const id = fieldValue(e4);
    e4.target.value = "";
    if (id) onPick(id);
  };
  const option = (one) => {
    const about = [labelOf(one), ownerOf(one)].filter(Boolean).join(" – ");
    return /* @__PURE__ */ a4("option", { value: idOf(one), children: shorten(about, 70) }, idOf(one));
  };
  return /* @__PURE__ */ a4(
    "select",
    {
      class: "add-line",
      "aria-label": label,
      title: label,
      value: "",
      onChange,
      onPointerEnter: look,
      onFocus: look,
      children: [
        /* @__PURE__ */ a4("option", { value: "", children: text2 }),
        GROUPS.map(([source, name]) => {
          const some = found.filter((one) => one.source === source);
          return some.length > 0 && /* @__PURE__ */ a4("optgroup", { label: name, children: some.map(option) });
        }),
        !found.length && /* @__PURE__ */ a4("option", { disabled: true, children: "no other numbers yet" })
      ]
    }
  );
}

// src/core/questions.ts
var CLOSES_MS = 3e3;
var URGENT_S = 10;
function questionsOf(data, now) {
  const shown = [];
  for (const [path, state] of Object.entries(data.states)) {
    const { question } = state;
    if (!question) continue;
    const isOpen2 = state.since != null && question.answered === null;
    const ago = question.answered === null ? Infinity : now - (ms(question.answered) ?? 0);
    if (!isOpen2 && (data.ended != null || !(ago < CLOSES_MS))) continue;
    const waited = (now - (ms(question.asked) ?? 0)) / 1e3;
    const left = Math.max(0, question.patience - waited);
    shown.push({ ...question, path, left, share: Math.min(1, left / question.patience), isOpen: isOpen2, ago });
  }
  return shown.sort((a5, b3) => a5.asked - b3.asked || (a5.path < b3.path ? -1 : 1));
}
var isUrgent = (one) => one.isOpen && one.left <= URGENT_S;
function buttonsOf({ answers, words: words2, default: otherwise }) {
  const safe = answers.includes(otherwise) ? otherwise : answers[answers.length - 1];
  const all = answers.map((answer, i4) => ({ answer, text: words2[i4] || answer, isFirst: answer === answers[0] }));
  return [...all.filter((one) => one.answer === safe), ...all.filter((one) => one.answer !== safe)];
}
function answerText({ answer, by, ago }) {
  const seconds = `${Math.max(0, Math.round(ago / 1e3))} s ago`;
  return by ? `answered ${answer} by ${by}, ${seconds}` : `nobody answered: ${answer}, ${seconds}`;
}
function titleOf3(title, shown, elsewhere) {
  const waiting = shown.filter((one) => one.isOpen);
  const urgent = waiting.find(isUrgent);
  const count = waiting.length + elsewhere;
  if (urgent && Math.floor(urgent.left) % 2) return `? ${urgent.text}`;
  return count ? `(${count}) ${title}` : title;
}
var heldStates = (data) => Object.entries(data.states).filter(([, state]) => state.since != null || state.waits != null).filter(([, state]) => state.waits === "breakpoint").map(([path]) => path);

// src/panels/questions.tsx
var RADIUS = 18;
var AROUND2 = 2 * Math.PI * RADIUS;
var MOST_ELSEWHERE = 4;
var LONGEST3 = 600;
var TONES = [880, 1175];
var TONE_S = 0.16;
var sounded = /* @__PURE__ */ new Set();
function questionsShown() {
  const isOver = isFile() || store.data.facts.value?.recorded;
  if (isOver)
    return questionsOf(store.playback.shown(), store.playback.cursor.value ?? store.playback.nowMs()).filter(
      (one) => one.isOpen
    );
  return questionsOf(store.data.run.now, store.data.liveMs());
}
function Questions({ page: page2 }) {
  store.playback.watch();
  const shown = store.data.model.value ? questionsShown() : [];
  const held = control() && store.playback.cursor.value === null ? heldStates(store.data.run.now) : [];
  const facts = store.data.facts.value;
  const others = store.data.machines.value.filter((one) => one.name !== facts?.name && one.stale == null);
  const asking = isFile() ? [] : others.filter((one) => one.questions);
  const elsewhere = asking.reduce((sum, one) => sum + (one.questions ?? 0), 0);
  const title = titleOf3(facts ? `${facts.label} – smachpy` : "smachpy", shown, elsewhere);
  A2(() => {
    if (!isFile()) document.title = title;
  }, [title]);
  A2(() => {
    if (isFile() || facts?.recorded) return;
    const unsounded = shown.filter((one) => one.isOpen && !sounded.has(one.asked));
    for (const one of unsounded) sounded.add(one.asked);
    if (unsounded.length && store.view.sound.value) chime();
  });
  if (!shown.length && !held.length && !asking.length) return null;
  return /* @__PURE__ */ a4("section", { class: "questions", "aria-label": "questions", children: [
    shown.map((one) => /* @__PURE__ */ a4(Card, { one, page: page2 }, `${one.path} ${one.asked}`)),
    held.map((path) => /* @__PURE__ */ a4(HeldCard, { path, page: page2 }, path)),
    asking.slice(0, MOST_ELSEWHERE).map((one) => /* @__PURE__ */ a4(Elsewhere, { machine: one }, one.name))
  ] });
}
var Elsewhere = ({ machine }) => /* @__PURE__ */ a4("div", { class: "question elsewhere", role: "status", children: [
  /* @__PURE__ */ a4("span", { children: [
    /* @__PURE__ */ a4("b", { children: shorten(machine.label, 40) }),
    /* @__PURE__ */ a4("span", { class: "hint", children: [
      " ",
      shorten(machine.name, 60)
    ] }),
    " asks its operator"
  ] }),
  /* @__PURE__ */ a4("button", { onClick: () => choose(machine.name), children: "Show" })
] });
function Card({ one, page: page2 }) {
  const [sent2, setSent] = d2(false);
  const text2 = T2(null);
  A2(() => {
    const focused = document.activeElement;
    if (one.isOpen && (!focused || focused === document.body)) text2.current?.focus({ preventScroll: true });
  }, []);
  const give = async (answer) => {
    setSent(true);
    const by = store.view.operator.value.trim() || void 0;
    if (!await command("answer", { path: one.path, answer, by })) setSent(false);
  };
  const id = `question-${encoded(one.path)}`;
  return /* @__PURE__ */ a4("div", { class: `question ${one.isOpen ? "" : "over"}`, role: "alertdialog", "aria-labelledby": id, children: [
    /* @__PURE__ */ a4("header", { children: [
      /* @__PURE__ */ a4("div", { children: [
        /* @__PURE__ */ a4("h3", { id, ref: text2, tabindex: -1, children: shortenLines(one.text, LONGEST3) }),
        /* @__PURE__ */ a4(StateLink, { path: one.path, page: page2 })
      ] }),
      one.isOpen && /* @__PURE__ */ a4(Ring, { one })
    ] }),
    one.isOpen && one.has_picture && !isFile() && /* @__PURE__ */ a4(Picture2, { one }),
    one.isOpen ? /* @__PURE__ */ a4(Buttons, { one, sent: sent2, give, page: page2 }) : null,
    /* @__PURE__ */ a4("p", { class: "hint", role: one.isOpen ? void 0 : "status", children: one.isOpen ? /* @__PURE__ */ a4($, { children: [
      "No answer in ",
      Math.ceil(one.left),
      " s means ",
      /* @__PURE__ */ a4("b", { children: shorten(one.default, 80) }),
      "."
    ] }) : shorten(answerText(one), 200) })
  ] });
}
function Buttons({
  one,
  sent: sent2,
  give,
  page: page2
}) {
  if (isFile() || store.data.facts.value?.recorded) return null;
  if (store.playback.cursor.value !== null)
    return /* @__PURE__ */ a4("div", { class: "answers", children: /* @__PURE__ */ a4("button", { class: "answer primary", onClick: () => page2.timeline.live(), children: "Back to live to answer" }) });
  const may = canAnswer();
  const button = ({ answer, text: text2, isFirst }) => /* @__PURE__ */ a4(
    "button",
    {
      class: `answer ${isFirst ? "primary" : ""}`,
      disabled: !may || sent2,
      title: answer,
      onClick: () => give(answer),
      children: shorten(text2, 60)
    }
  );
  return /* @__PURE__ */ a4($, { children: [
    /* @__PURE__ */ a4("div", { class: "answers", children: buttonsOf(one).map(button) }),
    !may && /* @__PURE__ */ a4("p", { class: "hint", children: [
      "This page cannot answer. In a terminal: ",
      /* @__PURE__ */ a4("code", { children: "smachpy answer ANSWER" })
    ] })
  ] });
}
var Ring = ({ one }) => /* @__PURE__ */ a4("svg", { class: `ring ${isUrgent(one) ? "urgent" : ""}`, viewBox: "0 0 44 44", "aria-hidden": "true", children: [
  /* @__PURE__ */ a4("circle", { cx: "22", cy: "22", r: RADIUS }),
  /* @__PURE__ */ a4(
    "circle",
    {
      class: "left",
      cx: "22",
      cy: "22",
      r: RADIUS,
      transform: "rotate(-90 22 22)",
      "stroke-dasharray": `${(one.share * AROUND2).toFixed(1)} ${AROUND2.toFixed(1)}`
    }
  ),
  /* @__PURE__ */ a4("text", { x: "22", y: "27", children: Math.ceil(one.left) })
] });
function Picture2({ one }) {
  const [gone, setGone] = d2(false);
  if (gone) return null;
  const source = link("question", `&path=${encoded(one.path)}&asked=${one.asked}`);
  return /* @__PURE__ */ a4("img", { class: "question-picture", alt: "what the question is about", src: source, onError: () => setGone(true) });
}
var HeldCard = ({ path, page: page2 }) => /* @__PURE__ */ a4("div", { class: "question held", role: "alertdialog", "aria-label": "breakpoint", children: [
  /* @__PURE__ */ a4("header", { children: /* @__PURE__ */ a4("h3", { children: [
    "Paused before ",
    /* @__PURE__ */ a4(StateLink, { path, page: page2 }),
    " (breakpoint)"
  ] }) }),
  /* @__PURE__ */ a4("div", { class: "answers", children: [
    /* @__PURE__ */ a4("button", { class: "answer", onClick: () => command("step"), children: "Step" }),
    /* @__PURE__ */ a4("button", { class: "answer primary", onClick: () => command("resume"), children: "Resume" })
  ] })
] });
function chime() {
  if (typeof AudioContext === "undefined") return;
  const audio = new AudioContext();
  TONES.forEach((tone, i4) => {
    const source = audio.createOscillator();
    const volume = audio.createGain();
    const at = audio.currentTime + i4 * TONE_S;
    source.frequency.value = tone;
    volume.gain.setValueAtTime(0.12, at);
    volume.gain.exponentialRampToValueAtTime(1e-3, at + TONE_S);
    source.connect(volume).connect(audio.destination);
    source.start(at);
    source.stop(at + TONE_S);
    if (i4 === TONES.length - 1) source.onended = () => audio.close();
  });
}

// src/core/simulations.ts
var WHOLE = /^\s*-?\d{1,9}\s*$/;
function startOf({ mission, runs: runs2, vary, seed, limit, compare: compare2 }) {
  const problems = [
    mission ? "" : "mission: got none; expected one",
    WHOLE.test(runs2) && Number(runs2) >= 1 ? "" : `runs: got ${runs2 || "nothing"}; expected a whole number from 1 on`,
    WHOLE.test(seed) ? "" : `seed: got ${seed || "nothing"}; expected a whole number`
  ].filter(Boolean);
  const lines = vary.split("\n").map((line) => line.trim()).filter(Boolean);
  const asked2 = { command: "start", mission, runs: Number(runs2), vary: lines, seed: Number(seed), limit, compare: compare2 };
  return { asked: problems.length ? null : asked2, problem: problems.join("; ") };
}
var doneOf = ({ outcomes, failed }) => Object.values(outcomes).reduce((sum, count) => sum + count, failed);

// src/panels/simulate.tsx
var REFRESH_MS4 = 1e3;
var FORM = { mission: "", runs: "20", vary: "", seed: "1", limit: "4h", compare: "" };
var SimulatePage = () => store.view.pageShown.value === "simulate" ? /* @__PURE__ */ a4(OpenPage2, {}) : null;
function OpenPage2() {
  const [form, setForm] = d2(FORM);
  const [problems, setProblems] = d2("");
  const { missions, batches } = store.data.simulations.value;
  const names = Object.keys(missions);
  const known2 = store.data.simulationsKnown.value;
  const mission = form.mission || names[0] || "";
  const heading = T2(null);
  A2(() => heading.current?.focus(), []);
  A2(() => {
    refreshSimulations();
    const timer = setInterval(refreshSimulations, REFRESH_MS4);
    return () => clearInterval(timer);
  }, []);
  const onSubmit = async (e4) => {
    e4.preventDefault();
    const { asked: asked2, problem } = startOf({ ...form, mission });
    setProblems(problem);
    if (!asked2) return;
    const answer = await askSimulation(asked2);
    setProblems(answer.ok ? "" : answer.text ?? "refused");
  };
  const change3 = (name) => (e4) => setForm({ ...form, [name]: fieldValue(e4) });
  const earlier = batches.filter((one) => one.mission === mission && !one.running && one.report);
  return /* @__PURE__ */ a4("section", { class: "simulate", "aria-labelledby": "simulate-title", children: [
    /* @__PURE__ */ a4("header", { children: [
      /* @__PURE__ */ a4("h2", { id: "simulate-title", tabindex: -1, ref: heading, children: "Simulated runs" }),
      /* @__PURE__ */ a4("span", { class: "spread" }),
      /* @__PURE__ */ a4("button", { onClick: () => showPage("runs"), children: "Close" })
    ] }),
    hasToken() ? /* @__PURE__ */ a4("form", { onSubmit, children: [
      /* @__PURE__ */ a4("label", { children: [
        "Mission",
        " ",
        /* @__PURE__ */ a4("select", { value: mission, onChange: change3("mission"), children: [
          !names.length && /* @__PURE__ */ a4("option", { value: "", children: known2 ? "none installed" : "reading the missions…" }),
          names.map((name) => /* @__PURE__ */ a4("option", { value: name, children: name }))
        ] })
      ] }),
      /* @__PURE__ */ a4("label", { children: [
        "Runs ",
        /* @__PURE__ */ a4("input", { inputmode: "numeric", value: form.runs, onInput: change3("runs") })
      ] }),
      /* @__PURE__ */ a4("label", { children: [
        "Seed ",
        /* @__PURE__ */ a4("input", { inputmode: "numeric", value: form.seed, onInput: change3("seed") })
      ] }),
      /* @__PURE__ */ a4("label", { children: [
        "Limit of a run ",
        /* @__PURE__ */ a4("input", { value: form.limit, onInput: change3("limit") })
      ] }),
      /* @__PURE__ */ a4("label", { class: "wide", children: [
        "Varied values, one per line",
        /* @__PURE__ */ a4(
          "textarea",
          {
            rows: 2,
            placeholder: "battery=0.2..1.0",
            spellcheck: false,
            value: form.vary,
            onInput: change3("vary")
          }
        )
      ] }),
      /* @__PURE__ */ a4("label", { class: "wide", children: [
        "Compare with",
        " ",
        /* @__PURE__ */ a4("select", { value: form.compare, onChange: change3("compare"), children: [
          /* @__PURE__ */ a4("option", { value: "", children: "nothing" }),
          earlier.map((one) => /* @__PURE__ */ a4("option", { value: one.id, children: [
            one.runs,
            " runs of ",
            beganText(one.began_ns, /* @__PURE__ */ new Date())
          ] }))
        ] })
      ] }),
      problems && /* @__PURE__ */ a4("p", { class: "problem wide", children: problems }),
      /* @__PURE__ */ a4("p", { class: "wide", children: [
        /* @__PURE__ */ a4("button", { class: "primary", type: "submit", disabled: !mission, children: "Start" }),
        /* @__PURE__ */ a4("span", { class: "hint", children: shorten(missions[mission] ?? "", 90) })
      ] })
    ] }) : /* @__PURE__ */ a4("p", { class: "hint", children: "Only a viewer with --control can start runs, at its address with the token." }),
    /* @__PURE__ */ a4("ul", { class: "batches", children: batches.map((one) => /* @__PURE__ */ a4(BatchRow, { batch: one }, one.id)) })
  ] });
}
function BatchRow({ batch }) {
  const { id, mission, runs: runs2, running, outcomes, failed, problem, report, vary } = batch;
  const done = doneOf(batch);
  const why = problem || batch.first_failure;
  const stop = () => askSimulation({ command: "stop", batch: id });
  return /* @__PURE__ */ a4("li", { children: [
    /* @__PURE__ */ a4("div", { children: [
      /* @__PURE__ */ a4("b", { children: shorten(mission, 40) }),
      " ",
      /* @__PURE__ */ a4("span", { class: "hint", children: [
        beganText(batch.began_ns, /* @__PURE__ */ new Date()),
        vary.length > 0 && `, ${shorten(vary.join(", "), 60)}`
      ] })
    ] }),
    /* @__PURE__ */ a4("div", { children: [
      running ? /* @__PURE__ */ a4($, { children: [
        /* @__PURE__ */ a4("progress", { max: runs2, value: done }),
        " ",
        done,
        " of ",
        runs2,
        " "
      ] }) : `${done} runs `,
      Object.entries(outcomes).map(([outcome, count]) => /* @__PURE__ */ a4($, { children: [
        /* @__PURE__ */ a4(Pill, { kind: outcomeClass(outcome), children: [
          shorten(outcome, 20),
          " ×",
          count
        ] }),
        " "
      ] })),
      failed > 0 && /* @__PURE__ */ a4(Pill, { kind: "failure", children: [
        "no end ×",
        failed
      ] }),
      " ",
      running && hasToken() && /* @__PURE__ */ a4("button", { class: "small", "aria-label": `stop ${id}`, onClick: stop, children: "Stop" }),
      report && /* @__PURE__ */ a4(
        "a",
        {
          href: `/api/report?batch=${encoded(id)}`,
          target: "_blank",
          rel: "noopener noreferrer",
          "aria-label": `report of ${id}`,
          children: "Report"
        }
      )
    ] }),
    why && /* @__PURE__ */ a4("small", { class: "problem", children: shorten(why, 200) })
  ] });
}

// src/panels/view_menu.tsx
var MOST_LEVELS = 9;
var MOST_ACTIVE = 200;
var FollowButton = ({ page: page2 }) => /* @__PURE__ */ a4(
  "button",
  {
    class: store.view.follow.value ? "on" : "",
    "aria-pressed": store.view.follow.value,
    title: "follow the running states (o)",
    onClick: () => page2.layouts.setFollow(!store.view.follow.value),
    children: "Follow"
  }
);
var toggleTree = () => {
  store.view.treeOpen.value = !store.view.treeOpen.value;
};
function ViewMenu({ page: page2 }) {
  const [open, setOpen] = d2(false);
  const box = T2(null);
  A2(() => {
    const away = (e4) => {
      if (!box.current?.contains(e4.target)) setOpen(false);
    };
    addEventListener("pointerdown", away);
    return () => removeEventListener("pointerdown", away);
  }, []);
  F2(() => {
    if (!open) return;
    const onKeyDown = (e4) => {
      if (e4.key !== "Escape") return;
      e4.stopPropagation();
      setOpen(false);
      box.current?.querySelector("button")?.focus();
    };
    addEventListener("keydown", onKeyDown, { capture: true });
    return () => removeEventListener("keydown", onKeyDown, { capture: true });
  }, [open]);
  const onFocusOut = (e4) => {
    if (e4.relatedTarget && !box.current?.contains(e4.relatedTarget)) setOpen(false);
  };
  const showKeys = () => {
    store.view.help.value = true;
    setOpen(false);
  };
  const onShortcuts = (e4) => {
    store.view.shortcuts.value = e4.target.checked;
    save("shortcuts", store.view.shortcuts.value);
  };
  const find = () => {
    store.view.paletteOpen.value = true;
    setOpen(false);
  };
  const onMachine2 = store.view.pageShown.value === "machine";
  const onImplicit = (e4) => page2.layouts.setImplicit(e4.target.checked);
  const onTheme = (e4) => page2.setTheme(fieldValue(e4));
  return /* @__PURE__ */ a4("div", { class: "menu", ref: box, onFocusOut, children: [
    /* @__PURE__ */ a4("button", { "aria-expanded": open, onClick: () => setOpen(!open), children: "View" }),
    open && /* @__PURE__ */ a4("div", { class: "sheet", children: [
      onMachine2 && /* @__PURE__ */ a4($, { children: [
        /* @__PURE__ */ a4("div", { class: "line narrow", children: [
          /* @__PURE__ */ a4(FollowButton, { page: page2 }),
          /* @__PURE__ */ a4(ActionsButton, {}),
          /* @__PURE__ */ a4("button", { class: "on-phones", onClick: toggleTree, children: "States" }),
          /* @__PURE__ */ a4("button", { class: "on-phones", onClick: find, children: "Find" })
        ] }),
        /* @__PURE__ */ a4(Levels, { page: page2 }),
        /* @__PURE__ */ a4("label", { class: "line", children: [
          /* @__PURE__ */ a4("span", { children: "Implicit transitions" }),
          /* @__PURE__ */ a4("input", { type: "checkbox", checked: store.view.implicit.value, onChange: onImplicit })
        ] }),
        /* @__PURE__ */ a4(NumbersLine, { page: page2 }),
        /* @__PURE__ */ a4(ReproduceLine, {}),
        /* @__PURE__ */ a4(CompareLine, { page: page2, onDone: () => setOpen(false) })
      ] }),
      /* @__PURE__ */ a4("label", { class: "line", children: [
        /* @__PURE__ */ a4("span", { children: "Colours" }),
        /* @__PURE__ */ a4("select", { value: store.view.theme.value, onChange: onTheme, children: [
          /* @__PURE__ */ a4("option", { value: "system", children: "as the system" }),
          /* @__PURE__ */ a4("option", { value: "light", children: "light" }),
          /* @__PURE__ */ a4("option", { value: "dark", children: "dark" })
        ] })
      ] }),
      onMachine2 && !store.view.isPhone.value && /* @__PURE__ */ a4(PanelLines, {}),
      !isFile() && /* @__PURE__ */ a4(AboutQuestions, {}),
      onMachine2 && !isFile() && /* @__PURE__ */ a4(Downloads, {}),
      /* @__PURE__ */ a4("div", { class: "line", children: [
        /* @__PURE__ */ a4("span", { children: "Keys" }),
        /* @__PURE__ */ a4("button", { onClick: showKeys, children: "show (?)" })
      ] }),
      /* @__PURE__ */ a4("label", { class: "line", children: [
        /* @__PURE__ */ a4("span", { children: "Single keys are shortcuts" }),
        /* @__PURE__ */ a4("input", { type: "checkbox", checked: store.view.shortcuts.value, onChange: onShortcuts })
      ] })
    ] })
  ] });
}
function ReproduceLine() {
  if (!canReproduce()) return null;
  return /* @__PURE__ */ a4("div", { class: "line", children: [
    /* @__PURE__ */ a4("span", { children: "This run again" }),
    /* @__PURE__ */ a4(ReproduceButtons, {})
  ] });
}
function AboutQuestions() {
  const onSound = (e4) => {
    store.view.sound.value = e4.target.checked;
    save("sound", store.view.sound.value);
  };
  const onName = (e4) => {
    store.view.operator.value = fieldValue(e4);
    save("operator", store.view.operator.value);
  };
  return /* @__PURE__ */ a4($, { children: [
    /* @__PURE__ */ a4("label", { class: "line", children: [
      /* @__PURE__ */ a4("span", { children: "Sound for questions" }),
      /* @__PURE__ */ a4("input", { type: "checkbox", checked: store.view.sound.value, onChange: onSound })
    ] }),
    /* @__PURE__ */ a4("label", { class: "line", children: [
      /* @__PURE__ */ a4("span", { children: "You answer as" }),
      /* @__PURE__ */ a4("input", { maxlength: 60, placeholder: "your name", value: store.view.operator.value, onInput: onName })
    ] })
  ] });
}
function Levels({ page: page2 }) {
  const depths = store.data.model.value?.order.map((node) => node.depth) ?? [];
  const deepest = depths.reduce((most, depth) => Math.max(most, depth), 1);
  const levels = Array.from({ length: Math.min(deepest, MOST_LEVELS) }, (_5, i4) => i4 + 1);
  return /* @__PURE__ */ a4("div", { class: "line", children: [
    /* @__PURE__ */ a4("span", { children: "Levels" }),
    /* @__PURE__ */ a4("span", { class: "group", children: [
      levels.map((level) => /* @__PURE__ */ a4("button", { onClick: () => page2.layouts.setDepth(level), children: level })),
      /* @__PURE__ */ a4("button", { onClick: () => page2.layouts.setDepth(ALL_LEVELS), children: "all" })
    ] })
  ] });
}
function NumbersLine({ page: page2 }) {
  const isMissing = (mode) => OF_RECORDED_RUNS.includes(mode) && !store.data.statistics.value;
  return /* @__PURE__ */ a4("label", { class: "line", children: [
    /* @__PURE__ */ a4("span", { children: "Numbers" }),
    /* @__PURE__ */ a4("select", { value: store.view.numbers.value, onChange: (e4) => page2.setNumbers(fieldValue(e4)), children: MODES.map(([mode, text2]) => /* @__PURE__ */ a4("option", { value: mode, disabled: isMissing(mode), children: text2 })) })
  ] });
}
function Downloads() {
  const active = store.status.activePaths.value.slice(0, MOST_ACTIVE).map((path) => `&active=${encoded(path)}`);
  const looks = `&theme=${isDark() ? "dark" : "light"}${active.join("")}`;
  const picture = (format) => /* @__PURE__ */ a4("a", { class: "button", href: link("picture", `&format=${format}${looks}`), download: true, children: format });
  return /* @__PURE__ */ a4($, { children: [
    /* @__PURE__ */ a4("div", { class: "line", children: [
      /* @__PURE__ */ a4("span", { children: "Save picture" }),
      /* @__PURE__ */ a4("span", { class: "group", children: ["svg", "png", "pdf", "dot"].map(picture) })
    ] }),
    /* @__PURE__ */ a4("div", { class: "line", children: [
      /* @__PURE__ */ a4("span", { children: "Save run" }),
      /* @__PURE__ */ a4("span", { class: "group", children: [
        /* @__PURE__ */ a4("a", { class: "button", href: link("export", "&format=html"), download: true, children: "html page" }),
        /* @__PURE__ */ a4("a", { class: "button", href: link("export", "&format=jsonl"), download: true, children: "recording" })
      ] })
    ] })
  ] });
}

// src/panels/top_bar.tsx
var MOST_FOUND = 12;
var ENDED2 = "ended: ";
var SEAL = "evidence: ";
function TopBar({ page: page2 }) {
  if (store.view.pageShown.value !== "machine")
    return /* @__PURE__ */ a4("header", { class: "top", children: [
      /* @__PURE__ */ a4(RunsButton, {}),
      store.data.model.value && /* @__PURE__ */ a4("button", { class: "back", title: "back to this machine (Esc)", onClick: () => showPage("machine"), children: [
        "← ",
        shorten(store.data.facts.value?.label ?? "", 40)
      ] }),
      /* @__PURE__ */ a4("span", { class: "spread" }),
      /* @__PURE__ */ a4(ViewMenu, { page: page2 }),
      /* @__PURE__ */ a4(ActionsButton, { id: "actions" })
    ] });
  const status = store.status.runStatus.value;
  const problems = store.data.problems.value.length;
  return /* @__PURE__ */ a4("header", { class: "top", children: [
    /* @__PURE__ */ a4(
      "button",
      {
        class: "states-button",
        "aria-expanded": store.view.treeOpen.value,
        title: "the states as a tree (t)",
        onClick: toggleTree,
        children: "States"
      }
    ),
    /* @__PURE__ */ a4(RunsButton, {}),
    /* @__PURE__ */ a4(Chooser, {}),
    /* @__PURE__ */ a4("span", { class: `status ${status.kind}`, role: "status", title: status.word, "data-testid": "status", children: [
      status.word.startsWith(ENDED2) ? /* @__PURE__ */ a4("span", { class: "ended-word", children: ENDED2 }) : "",
      status.word.startsWith(ENDED2) ? status.word.slice(ENDED2.length) : status.word
    ] }),
    canAskWhy() && /* @__PURE__ */ a4(
      "button",
      {
        class: `why-button ${store.data.why.value ? "on" : ""}`,
        "aria-pressed": store.data.why.value !== null,
        title: "from the first cause to the outcome (w)",
        onClick: () => showWhy(),
        children: "Why?"
      }
    ),
    /* @__PURE__ */ a4(SealChip, {}),
    /* @__PURE__ */ a4(ReproduceButtons, { class: "wide" }),
    problems > 0 && /* @__PURE__ */ a4("span", { class: "chip", title: "problems of the machine's structure; see the inspector", children: [
      "⚠ ",
      problems
    ] }),
    /* @__PURE__ */ a4(CompareChip, { page: page2 }),
    /* @__PURE__ */ a4(Crumbs, { page: page2 }),
    /* @__PURE__ */ a4("span", { class: "spread" }),
    /* @__PURE__ */ a4(Search, { page: page2 }),
    /* @__PURE__ */ a4("span", { class: "wide", children: /* @__PURE__ */ a4(FollowButton, { page: page2 }) }),
    /* @__PURE__ */ a4(ViewMenu, { page: page2 }),
    /* @__PURE__ */ a4("span", { class: "wide", children: /* @__PURE__ */ a4(ActionsButton, { id: "actions" }) })
  ] });
}
function RunsButton() {
  if (isFile()) return null;
  const open = store.view.pageShown.value === "runs";
  return /* @__PURE__ */ a4(
    "button",
    {
      id: "runs",
      class: open ? "on" : "",
      "aria-pressed": open,
      title: "live and past runs (h)",
      onClick: () => togglePage("runs"),
      children: "Runs"
    }
  );
}
function canAskWhy() {
  store.playback.watch();
  const { now } = store.data.run;
  const about = store.data.facts.value;
  return now.started != null && (now.ended != null || about?.recorded || about?.stale != null || isFile());
}
function SealChip() {
  store.playback.watch();
  const root = store.data.model.value?.root.path ?? "";
  const note = store.data.run.now.states[root]?.note ?? "";
  if (!note.startsWith(SEAL)) return null;
  const text2 = note.slice(SEAL.length);
  const [sign2, word] = text2.startsWith("valid") ? ["✓", "certified"] : ["⚠", text2.startsWith("nothing") ? "not tried" : "no evidence"];
  return /* @__PURE__ */ a4("span", { class: "chip seal", title: note, "data-testid": "seal", children: [
    sign2,
    " ",
    /* @__PURE__ */ a4("span", { class: "seal-word", children: word })
  ] });
}
function Chooser() {
  const facts = store.data.facts.value;
  const list = store.data.machines.value;
  const name = facts ? shorten(facts.label, 60) : "no machine yet";
  const others = list.some((machine) => machine.name !== facts?.name);
  if (isFile() || !others) return /* @__PURE__ */ a4("h1", { title: facts?.name, children: name });
  const choice = (machine) => {
    const title = machine.node ? `in node ${machine.node}` : "";
    return /* @__PURE__ */ a4("option", { value: machine.name, title, children: [
      machine.name,
      " – ",
      statusOf3(machine)
    ] });
  };
  return /* @__PURE__ */ a4("label", { class: "chooser", children: [
    /* @__PURE__ */ a4("span", { class: "hidden", children: "machine" }),
    /* @__PURE__ */ a4("select", { value: facts?.name ?? "", onChange: (e4) => choose(fieldValue(e4)), children: [
      !facts && /* @__PURE__ */ a4("option", { value: "", disabled: true, children: shorten(store.data.wanted.value || "choose a machine", 60) }),
      list.map(choice)
    ] })
  ] });
}
function statusOf3({ recorded, stale, ended, outcome, questions }) {
  if (questions && stale == null && !recorded) return "asks you";
  if (ended != null) return `${recorded ? "recorded" : "ended"}: ${outcome}`;
  if (recorded) return "recording, without an end";
  return stale != null ? "stale" : "running";
}
function Crumbs({ page: page2 }) {
  const model = store.data.model.value;
  const selected = store.view.selected.value;
  const leaves = store.status.activeLeaves.value;
  const node = model?.get(selected ?? leaves[0]);
  if (!model || !node) return null;
  const more = selected ? 0 : leaves.length - 1;
  const crumb = (one, i4) => /* @__PURE__ */ a4($, { children: [
    i4 > 0 && /* @__PURE__ */ a4("i", { children: "›" }),
    /* @__PURE__ */ a4("button", { onClick: () => page2.goTo(one.path), children: one.name })
  ] });
  return /* @__PURE__ */ a4("nav", { class: "crumbs", "aria-label": `path of the ${selected ? "selected" : "active"} state`, children: [
    [...model.ancestors(node.path), node].map(crumb),
    more > 0 && /* @__PURE__ */ a4("span", { class: "chip", title: leaves.join("\n"), children: [
      "+",
      more,
      " active"
    ] })
  ] });
}
function Search({ page: page2 }) {
  const [at, setAt] = d2(0);
  const text2 = store.view.query.value;
  const found = text2 ? store.data.model.value?.search(text2) ?? [] : [];
  const shown = found.slice(0, MOST_FOUND);
  const pick = (node) => {
    if (!node) return;
    page2.goTo(node.path);
    store.view.query.value = "";
    if (document.activeElement instanceof HTMLElement) document.activeElement.blur();
  };
  const onKeyDown = (e4) => {
    if (e4.key === "Enter") pick(shown[Math.min(at, shown.length - 1)]);
    else if (e4.key === "Escape") {
      store.view.query.value = "";
      e4.target.blur();
    } else if (e4.key === "ArrowDown" || e4.key === "ArrowUp") {
      const to = e4.key === "ArrowDown" ? Math.min(at + 1, shown.length - 1) : at - 1;
      setAt(Math.max(to, 0));
      e4.preventDefault();
    } else return;
    e4.stopPropagation();
  };
  const onInput = (e4) => {
    store.view.query.value = fieldValue(e4);
    setAt(0);
  };
  A2(() => page2.markHits(found.map((node) => node.path)), [text2]);
  return /* @__PURE__ */ a4("div", { class: "search", children: [
    /* @__PURE__ */ a4(
      "input",
      {
        id: "search",
        placeholder: "Search",
        "aria-label": "Search states",
        value: text2,
        autocomplete: "off",
        spellcheck: false,
        onInput,
        onKeyDown
      }
    ),
    !text2 && /* @__PURE__ */ a4("kbd", { children: "/" }),
    text2 && /* @__PURE__ */ a4("ul", { class: "results", role: "listbox", children: [
      shown.map((node, i4) => /* @__PURE__ */ a4(Found, { node, chosen: i4 === at, onPick: pick }, node.path)),
      !found.length && /* @__PURE__ */ a4("li", { class: "none", children: "no state of this name" }),
      found.length > shown.length && /* @__PURE__ */ a4("li", { class: "none", children: [
        "and ",
        found.length - shown.length,
        " more"
      ] })
    ] })
  ] });
}
var Found = ({ node, chosen: chosen2, onPick }) => /* @__PURE__ */ a4("li", { role: "option", "aria-selected": chosen2, class: chosen2 ? "at" : "", onPointerDown: () => onPick(node), children: [
  /* @__PURE__ */ a4("b", { children: node.name }),
  /* @__PURE__ */ a4("small", { children: node.parent ? node.parent.path : KIND_NAMES[node.kind] })
] });

// src/panels/tree.tsx
var ROW2 = 24;
var MARGIN3 = 6;
var SPARE = 4;
var MOST_INDENT = 12;
var GLYPHS = {
  action: "▶",
  service: "⇄",
  monitor: "◉",
  condition: "?",
  machine: "▣",
  sequence: "→",
  concurrence: "‖",
  iterator: "↻",
  missing: "✕"
};
var ENDED3 = { success: "✓", failure: "✕", preempted: "■", other: "•" };
function Tree({ page: page2 }) {
  const [top, setTop] = d2(0);
  const [folded, setFolded] = d2(() => /* @__PURE__ */ new Map());
  const [chosen2, setChosen] = d2(null);
  const box = T2(null);
  store.playback.watch();
  const model = store.data.model.value;
  if (!model) return /* @__PURE__ */ a4("aside", { class: "tree" });
  const states2 = store.playback.shown().states;
  const isOpen2 = (node) => folded.get(node.path) ?? (own(states2, node.path)?.since != null || store.view.opened.value.has(node.path));
  const rows = visibleRows(model.root, isOpen2);
  const height = box.current?.clientHeight ?? 800;
  const first = Math.max(0, Math.floor(top / ROW2) - SPARE);
  const inView = rows.slice(first, first + Math.ceil(height / ROW2) + 2 * SPARE);
  const at = Math.max(
    0,
    rows.findIndex((node) => node.path === (chosen2 ?? store.view.selected.value))
  );
  const fold = (node) => setFolded(new Map(folded).set(node.path, !isOpen2(node)));
  const goTo = (node) => {
    setChosen(node.path);
    page2.goTo(node.path);
    store.view.treeOpen.value = false;
  };
  const choose2 = (row) => {
    const to = Math.max(0, Math.min(row, rows.length - 1));
    const y5 = to * ROW2 + MARGIN3;
    setChosen(rows[to].path);
    if (box.current) box.current.scrollTop = Math.max(y5 + ROW2 - height, Math.min(box.current.scrollTop, y5 - MARGIN3));
  };
  const onKeyDown = (e4) => {
    if (e4.ctrlKey || e4.metaKey || e4.altKey) return;
    const node = rows[at];
    const isContainer = node.children.length > 0;
    const screen = Math.max(1, Math.floor(height / ROW2) - 1);
    const ends = { Home: 0, End: rows.length - 1, PageDown: at + screen, PageUp: at - screen };
    const row = { ArrowDown: at + 1, ArrowUp: at - 1, ...ends }[e4.key];
    if (row !== void 0) choose2(row);
    else if (e4.key === "Enter" || e4.key === " ") page2.goTo(node.path);
    else if (e4.key === "ArrowRight") {
      if (isContainer && !isOpen2(node)) fold(node);
      else if (isContainer) choose2(at + 1);
    } else if (e4.key === "ArrowLeft") {
      if (isContainer && isOpen2(node)) fold(node);
      else if (node.parent) choose2(rows.indexOf(node.parent));
    } else return;
    e4.preventDefault();
    e4.stopPropagation();
  };
  return /* @__PURE__ */ a4(
    "div",
    {
      class: "tree",
      "aria-label": "states",
      role: "tree",
      ref: box,
      tabindex: 0,
      onScroll: (e4) => setTop(e4.target.scrollTop),
      "aria-activedescendant": `row-${rows[at].number}`,
      onKeyDown,
      children: /* @__PURE__ */ a4("div", { style: { height: `${rows.length * ROW2}px` }, class: "rows", children: inView.map((node, i4) => /* @__PURE__ */ a4(
        Row4,
        {
          node,
          state: own(states2, node.path),
          open: isOpen2(node),
          place: first + i4,
          isAt: first + i4 === at,
          onClick: () => goTo(node),
          onFold: () => fold(node)
        },
        node.path
      )) })
    }
  );
}
function visibleRows(root, isOpen2) {
  const rows = [];
  const walk = (node) => {
    rows.push(node);
    if (isOpen2(node)) node.children.forEach(walk);
  };
  walk(root);
  return rows;
}
function Row4({
  node,
  state,
  open,
  place,
  isAt,
  onClick,
  onFold
}) {
  const active = state?.since != null;
  const selected = store.view.selected.value === node.path;
  const isContainer = node.children.length > 0;
  const kind = state?.outcome != null ? endClass(node, state.outcome) : null;
  const visits = state?.visits ?? 0;
  const classes = ["row", isAt && "at", active && "active", active && state.preempt && "preempting"];
  const style = { top: `${place * ROW2}px`, paddingLeft: `${8 + Math.min(node.depth, MOST_INDENT) * 14}px` };
  const onFoldClick = (e4) => {
    e4.stopPropagation();
    onFold();
  };
  return /* @__PURE__ */ a4(
    "div",
    {
      role: "treeitem",
      id: `row-${node.number}`,
      "aria-level": node.depth + 1,
      "aria-selected": selected,
      "aria-expanded": isContainer ? open : void 0,
      title: node.path,
      style,
      onClick,
      class: [...classes, selected && "selected"].filter(Boolean).join(" "),
      children: [
        isContainer ? /* @__PURE__ */ a4("button", { class: "fold", tabindex: -1, "aria-label": open ? "close" : "open", onClick: onFoldClick, children: open ? "▾" : "▸" }) : /* @__PURE__ */ a4("span", { class: "kind", children: GLYPHS[node.kind] ?? "·" }),
        /* @__PURE__ */ a4("span", { class: "name", children: node.name }),
        active && !isContainer && /* @__PURE__ */ a4("span", { class: "purpose", children: purposeOfState(node.path) }),
        !active && kind && /* @__PURE__ */ a4("span", { class: `ended ${kind}`, children: ENDED3[kind] }),
        visits > 1 && /* @__PURE__ */ a4("span", { class: "times", children: [
          "×",
          visits
        ] })
      ]
    }
  );
}

// src/app.tsx
var svg = el("svg", { class: "diagram", role: "application", "aria-label": "state machine", tabindex: 0 });
var minimap = el("svg", { class: "minimap", "aria-hidden": "true" });
var canvas = document.createElement("canvas");
canvas.tabIndex = 0;
canvas.setAttribute("role", "slider");
canvas.setAttribute("aria-label", "time; arrow keys go from event to event");
var whole = document.createElement("canvas");
whole.setAttribute("role", "img");
whole.setAttribute("aria-label", "the whole run, with failures; the keys of the timeline do the same");
var floor2 = document.createElement("canvas");
floor2.tabIndex = 0;
floor2.setAttribute("role", "img");
function Mounted({ element }) {
  const place = T2(null);
  F2(() => place.current?.replaceChildren(element), [element]);
  return /* @__PURE__ */ a4("div", { class: "mounted", ref: place });
}
function StripTools() {
  return /* @__PURE__ */ a4("div", { class: "strip-tools", children: [
    /* @__PURE__ */ a4(
      "select",
      {
        "aria-label": "clock",
        title: "how instants are told everywhere (c)",
        value: store.clock.chosen.value,
        onChange: (e4) => store.clock.choose(fieldValue(e4)),
        children: [
          /* @__PURE__ */ a4("option", { value: "run", children: "run time" }),
          /* @__PURE__ */ a4("option", { value: "wall", children: "wall clock" }),
          /* @__PURE__ */ a4("option", { value: "relative", children: "relative" })
        ]
      }
    ),
    /* @__PURE__ */ a4(
      "input",
      {
        class: "lane-filter",
        "aria-label": "lanes to show, by their names",
        placeholder: "lanes",
        value: store.view.laneFilter.value,
        onInput: (e4) => {
          store.view.laneFilter.value = fieldValue(e4);
        }
      }
    )
  ] });
}
function FoldIdle() {
  const { clock, playback } = store;
  playback.watchSlowly();
  if (!clock.idle().length) return null;
  const folds = clock.folds().length > 0;
  return /* @__PURE__ */ a4(
    "button",
    {
      class: folds ? "on" : "",
      "aria-pressed": folds,
      title: "fold long times in which nothing happened: they take little room, and a click unfolds one",
      onClick: () => clock.foldIdle(!folds),
      children: "Idle"
    }
  );
}
function TimeTools() {
  const { timeline } = page;
  const showAll = () => {
    timeline.window.fitAll();
    timeline.draw();
  };
  const addPlot = (id) => store.panels.setPlots([...store.panels.plotsShown.value, [id]]);
  return /* @__PURE__ */ a4("div", { class: "time-tools", children: [
    /* @__PURE__ */ a4("button", { title: "show the whole run", onClick: showAll, children: "All" }),
    /* @__PURE__ */ a4(FoldIdle, {}),
    /* @__PURE__ */ a4(AddLine, { label: "plot a number of the run", text: "Plot", onPick: addPlot })
  ] });
}
function ZoomButtons() {
  const { view: view2 } = store;
  const small = view2.textIsSmall.value;
  const on2 = view2.outline.value;
  const isLeast = view2.overview.value && view2.opened.value.size < 2;
  const showTree = () => {
    view2.treeOpen.value = true;
  };
  return /* @__PURE__ */ a4("span", { class: "zoom", children: [
    (on2 || small && !isLeast) && /* @__PURE__ */ a4(
      "button",
      {
        class: on2 ? "offer on" : "offer",
        "aria-pressed": on2,
        title: on2 ? "show the arrows again" : "names or labels are small: show less of the machine",
        onClick: () => page.layouts.toggleOutline(),
        children: "Outline"
      }
    ),
    small && isLeast && /* @__PURE__ */ a4("button", { class: "offer of-tree", title: "the names are small: show the states as a tree", onClick: showTree, children: "States" }),
    /* @__PURE__ */ a4("button", { title: "smaller (-)", "aria-label": "zoom out", onClick: () => page.view.zoom(0.8), children: "−" }),
    /* @__PURE__ */ a4("button", { title: "larger (+)", "aria-label": "zoom in", onClick: () => page.view.zoom(1.25), children: "+" }),
    /* @__PURE__ */ a4("button", { title: "show everything (0)", onClick: () => page.layouts.refit(), children: "Fit" })
  ] });
}
var panels = {
  tree: () => /* @__PURE__ */ a4(Tree, { page }),
  map: () => /* @__PURE__ */ a4(MapPanel, { page, children: /* @__PURE__ */ a4(Mounted, { element: floor2 }) }),
  details: () => /* @__PURE__ */ a4(Inspector, { page }),
  time: () => /* @__PURE__ */ a4("div", { class: "timeline", children: [
    /* @__PURE__ */ a4(Mounted, { element: whole }),
    /* @__PURE__ */ a4(StripTools, {}),
    /* @__PURE__ */ a4(Mounted, { element: canvas }),
    /* @__PURE__ */ a4(TimeTools, {}),
    /* @__PURE__ */ a4(TwoRunsView, { page })
  ] }),
  plots: () => /* @__PURE__ */ a4(PlotsPanel, { page })
};
function App() {
  const paused = store.data.facts.value?.control?.paused && store.playback.cursor.value === null;
  A2(() => {
    page.start().catch((error) => {
      store.data.failure.value = `The viewer could not start: ${messageOf(error)}`;
    });
  }, []);
  const classes = [
    "app",
    paused && "paused",
    store.playback.cursor.value !== null && "past",
    store.view.treeOpen.value && "with-tree",
    store.data.isMissing.value && "without-machine",
    control() && store.view.pageShown.value === "machine" && "operated",
    `part-${store.view.part.value}`,
    `on-${store.view.pageShown.value}`
  ];
  return /* @__PURE__ */ a4("div", { class: classes.filter(Boolean).join(" "), children: [
    /* @__PURE__ */ a4(TopBar, { page }),
    /* @__PURE__ */ a4(OperatorBar, {}),
    /* @__PURE__ */ a4(Questions, { page }),
    DOCKS.map((name) => /* @__PURE__ */ a4(Dock, { name, panels }, name)),
    /* @__PURE__ */ a4("main", { class: "stage", children: [
      /* @__PURE__ */ a4(Mounted, { element: svg }),
      /* @__PURE__ */ a4(Overlay, { page }),
      /* @__PURE__ */ a4(Laying, {}),
      /* @__PURE__ */ a4(Mounted, { element: minimap }),
      /* @__PURE__ */ a4("div", { class: "strip", children: [
        /* @__PURE__ */ a4(Legend, {}),
        /* @__PURE__ */ a4(ShareButtons, { page }),
        /* @__PURE__ */ a4(ZoomButtons, {})
      ] })
    ] }),
    /* @__PURE__ */ a4(PlayBar, { page }),
    /* @__PURE__ */ a4(Parts, {}),
    /* @__PURE__ */ a4(HomePage, {}),
    /* @__PURE__ */ a4(FleetPage, {}),
    /* @__PURE__ */ a4(ActionsPage, {}),
    /* @__PURE__ */ a4("div", { id: "announced", class: "hidden", "aria-live": "polite" }),
    /* @__PURE__ */ a4(ConfirmationSheet, {}),
    /* @__PURE__ */ a4(Notice, {}),
    /* @__PURE__ */ a4(Help, {}),
    /* @__PURE__ */ a4(Palette, { page }),
    /* @__PURE__ */ a4(TokenDialog, {}),
    /* @__PURE__ */ a4(NoteDialog, {}),
    /* @__PURE__ */ a4(SimulatePage, {})
  ] });
}
applyTheme();
var page = new Page(svg, minimap, canvas, floor2, whole);
listenToKeys(page);
window.smachpy = { page, store, ask, choose, reconnect };
Q(/* @__PURE__ */ a4(App, {}), document.getElementById("app"));
document.querySelector(".boot")?.remove();
